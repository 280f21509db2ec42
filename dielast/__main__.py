"""`python -m dielast`, for where the folder of installed commands is not on the search path."""

from dielast.cli import main

if __name__ == "__main__":
    main()
