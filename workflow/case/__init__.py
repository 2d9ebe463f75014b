"""Case files: keys, units, ranges, names, places in the file, and problems with them."""
