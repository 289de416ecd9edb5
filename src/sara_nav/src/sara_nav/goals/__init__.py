"""The goal that is driven to: checked, searched for, planned to, and its progress."""
