"""What came of a judged drive, as plain data."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any


class Judged:
    """Base of the dataclasses that hold what came of a drive: `contacts`, a tuple of Contact; `judgement`, a Judgement
    or None; `faults`, sentences.
    """

    @property
    def contact_faults(self) -> list[str]:
        """A sentence for each contact."""
        return [f'contact: {contact}' for contact in self.contacts]

    def to_json(self) -> dict[str, Any]:
        """All as plain data."""
        return {
            **asdict(self),
            'contacts': [contact.to_json() for contact in self.contacts],
            'judgement': self.judgement and self.judgement.to_json(),
            'faults': self.faults,
        }
