"""One store of stage products for runs, studies and accuracy; start with `store.py`, then `state.py` and `batch.py`.

keys.py     what a product depends on, as one digest: its key
product.py  a product folder: sealed with the digests of its files, checked, published at once
store.py    where products are, and where they are being made
state.py    which products are there and intact, which have to be made and why
view.py     a run folder: the products of one case under the names that users know
folders.py  folders that are the program's: marked, locked, cleaned
batch.py    making what is missing, by Snakemake (`engine.py`)
"""
