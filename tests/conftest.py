"""Before any test is loaded: compiled kernels belong to their sources, as in the command."""

from reflowshock.workflow.process.kernel_cache import keep_kernels_by_source

keep_kernels_by_source()
