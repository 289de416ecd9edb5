"""Results of the offline filter: tables, pictures, comparison with a reference path."""
