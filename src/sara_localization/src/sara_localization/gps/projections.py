"""pyproj's classes, without the warning that its data files are not found: none is needed for what is used here."""

import warnings

with warnings.catch_warnings():
    warnings.simplefilter('ignore')
    from pyproj import Proj, Transformer
    from pyproj.enums import TransformDirection

__all__ = ['Proj', 'TransformDirection', 'Transformer']
