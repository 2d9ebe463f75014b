"""The report of a run, from its products only; the page is put together in `page.py`."""
