"""Outlines and connected pieces of sets of facets."""

import numpy as np


def pieces(facets: np.ndarray) -> list[np.ndarray]:
    """Return the pieces of facets (f, m) that hang together by edges: row numbers of each, largest piece first."""
    ends = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edges = np.unique(ends, axis=0, return_inverse=True)[1].reshape(facets.shape)
    label = np.arange(int(edges.max()) + 1)
    while True:
        previous = label.copy()
        np.minimum.at(label, edges, label[edges].min(axis=1)[:, None])
        label = label[label]
        if np.array_equal(label, previous):
            break
    own = label[edges[:, 0]]
    found = [np.flatnonzero(own == value) for value in np.unique(own)]
    return sorted(found, key=len, reverse=True)


def outlines(facets: np.ndarray) -> list[np.ndarray]:
    """Return the closed lines along the edges that one facet (f, m) has, in its direction; longest first."""
    first, second = facets.ravel(), np.roll(facets, -1, axis=1).ravel()
    count = int(facets.max()) + 1
    forward, backward = first * np.int64(count) + second, second * np.int64(count) + first
    alone = ~np.isin(forward, backward)
    following = dict(zip(first[alone].tolist(), second[alone].tolist(), strict=True))
    lines = []
    while following:
        line = [next(iter(following))]
        while line[-1] in following:
            line.append(following.pop(line[-1]))
        lines.append(np.array(line[:-1]))
    return sorted(lines, key=len, reverse=True)
