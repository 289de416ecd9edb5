"""Work that is shared out: among the processes of this machine, or among workers on many."""
