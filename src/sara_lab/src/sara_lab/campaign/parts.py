"""The parts of the campaign by name, in the order they run."""

import functools
import json
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sara_lab.campaign.amcl import amcl
from sara_lab.campaign.amcl_nees import amcl_nees
from sara_lab.campaign.assisted import assisted, assisted_dock, assisted_doors, assisted_wall
from sara_lab.campaign.assisted_bus import assisted_bus
from sara_lab.campaign.blocked_doors import blocked_doors
from sara_lab.campaign.calm import calm
from sara_lab.campaign.chair import hazard_times, obstacle, odometry, sensors, square
from sara_lab.campaign.compass import compass
from sara_lab.campaign.exploring import explore
from sara_lab.campaign.filters import filter_fuzz, nees
from sara_lab.campaign.global_start import global_start
from sara_lab.campaign.kidnapped import kidnapped
from sara_lab.campaign.made_maps import made_maps, sonar_made_maps
from sara_lab.campaign.mapping import mapping
from sara_lab.campaign.pairs import fault_pairs
from sara_lab.campaign.part import Part
from sara_lab.campaign.scanned import scan
from sara_lab.campaign.skills import skills
from sara_lab.campaign.sonar_exploring import sonar_explore
from sara_lab.campaign.sonar_mapping import sonar_mapping
from sara_lab.campaign.squares import squares
from sara_lab.campaign.street import street
from sara_lab.campaign.travels import doors, journeys, pillars, tight, travel
from sara_lab.campaign.worlds import worlds
from sara_lab.workers.sources import folder_of

DEFAULT_FOLDER = Path('out/campaign')
PARTS = {
    'square': square,
    'hazards': hazard_times,
    'obstacle': obstacle,
    'pairs': fault_pairs,
    'odometry': odometry,
    'sensors': sensors,
    'squares': squares,
    'doors': doors,
    'blocked_doors': blocked_doors,
    'tight': tight,
    'pillars': pillars,
    'travel': travel,
    'scan': scan,
    'worlds': worlds,
    'journeys': journeys,
    'calm': calm,
    'nees': nees,
    'filter_fuzz': filter_fuzz,
    'amcl': amcl,
    'amcl_nees': amcl_nees,
    'kidnapped': kidnapped,
    'global_start': global_start,
    'mapping': mapping,
    'made_maps': made_maps,
    'explore': explore,
    'sonar_mapping': sonar_mapping,
    'sonar_explore': sonar_explore,
    'sonar_made_maps': sonar_made_maps,
    'assisted': assisted,
    'assisted_doors': assisted_doors,
    'assisted_wall': assisted_wall,
    'assisted_dock': assisted_dock,
    'assisted_bus': assisted_bus,
    'skills': skills,
    'compass': compass,
    'street': street,
}


def part_of(name: str, seeds: int, folder: Path, options: Mapping[str, Any]) -> Part:
    """A part of PARTS. folder: of what its cases keep; options: what it takes beside. Raises ForeignError."""
    return PARTS[name](seeds, folder, **options)


def text_of(part: Part, commit: str, case: str) -> str:
    """What the file of a part's case holds, which is made here."""
    return json.dumps({**part.cases[case](), 'commit': commit})


def text_by_name(name: str, seeds: int, options: Mapping[str, Any], commit: str, case: str) -> str:
    """The same by a cluster's worker, to which only names travel: cases keep what they do where `campaign` does by
    default.
    """
    return text_of(_part(name, seeds, pickle.dumps(options)), commit, case)


@functools.lru_cache(maxsize=1)
def _part(name, seeds, options):
    folder = folder_of(DEFAULT_FOLDER)
    folder.mkdir(parents=True, exist_ok=True)
    return part_of(name, seeds, folder, pickle.loads(options))
