"""The paper's own scheme (Hu et al., 2.2-2.6) and its moving least squares."""
