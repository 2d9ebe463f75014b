"""Store of stage products for runs, studies and accuracy tests; start with ``store.py``, then ``state.py``.

keys.py     product key: digest of all inputs of a product
product.py  product folder: sealed with the digests of its files, checked, published atomically
store.py    paths of products and of unfinished work
state.py    state of each product: intact, missing, stale or damaged, and why
view.py     run folder: links to the products of one case under readable names
folders.py  run folders: marked, locked, cleaned
"""
