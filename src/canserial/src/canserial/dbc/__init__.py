"""The bus as its DBC file describes it: packing, unpacking, and the file as a document."""
