"""Files and tables, as text and as workbooks."""
