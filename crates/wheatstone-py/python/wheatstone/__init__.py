"""Calibration and triangulation for any two or more cameras.

From matched pixels to metric 3-D points with error bars, on any optics, without choosing a camera model::

    import wheatstone as ws

    cal = ws.fit(pixels, points, views=views, unit="mm")   # (n, 4) and (n, 3); NaN: not seen
    print(cal.validation.all.rms, "mm on views left out")
    located = cal.locate(new_pixels)
    located.points, located.sigmas, located.trust

Cameras count from 0; pixel (0, 0) is the centre of the top-left pixel. Errors say what is wrong and what to do about
it: `wheatstone.errors`. Threads: `set_threads`, or ``WHEATSTONE_THREADS``.
Inputs larger than usual: `raise_limits`.
"""

from . import errors
from ._wheatstone import (
    FORMATS_READ,
    FORMATS_WRITTEN,
    METHODS,
    RIGS,
    __version__,
    get_threads,
)
from ._process import raise_limits, set_threads
from .calibration import Calibration
from .caliscope import read_caliscope
from .cameras import from_opencv, read_cameras
from .charts import Chart, Detection, detect, detect_all
from .data import Dataset, read
from .errors import DataWarning, WheatstoneError
from .fitting import calibrate, check, compare, fit, report
from .evaluation import BoardEvaluation, Comparison, Evaluation, Fold, MethodScore, Validation
from .findings import CameraChange, CameraMotion, Examination, Finding
from .located import Located, Trust
from .matching import DisparityMap, match_pair
from .reconstruction import PointCloud, Reconstructor, reconstruct
from .results import Rectification, Report
from .synthetic import synth, synth_capture

FORMATS: tuple[str, ...] = tuple(dict.fromkeys([*FORMATS_WRITTEN, *FORMATS_READ]))
"""Formats of calibrations of other programs."""

rectify = Calibration.rectify
load = Calibration.load

__all__ = [
    "FORMATS",
    "METHODS",
    "RIGS",
    "BoardEvaluation",
    "Calibration",
    "CameraChange",
    "CameraMotion",
    "Chart",
    "Comparison",
    "DataWarning",
    "Dataset",
    "Detection",
    "DisparityMap",
    "Evaluation",
    "Examination",
    "Finding",
    "Fold",
    "Located",
    "MethodScore",
    "PointCloud",
    "Reconstructor",
    "Rectification",
    "Report",
    "Trust",
    "Validation",
    "WheatstoneError",
    "__version__",
    "calibrate",
    "check",
    "compare",
    "detect",
    "detect_all",
    "errors",
    "fit",
    "from_opencv",
    "get_threads",
    "load",
    "match_pair",
    "read",
    "read_caliscope",
    "read_cameras",
    "reconstruct",
    "rectify",
    "report",
    "raise_limits",
    "set_threads",
    "synth",
    "synth_capture",
]
