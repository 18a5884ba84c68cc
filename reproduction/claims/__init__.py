"""Claims of the thesis beside what comes out here."""
