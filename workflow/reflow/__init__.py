"""Reflow of the joints of an array, between rigid plates or coupled with board and package that warm up."""
