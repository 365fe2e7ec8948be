"""Contact between deformable bodies by contact surfaces, on NVIDIA Warp."""

from warp_contact import interrupts  # noqa: F401  first, as the others take a second
from warp_contact.errors import SimulationError
from warp_contact.measure.contact_arrays import ContactArrays
from warp_contact.measure.contact_data import Contacts, PairForce
from warp_contact.measure.measure import Measure
from warp_contact.runs import sweep
from warp_contact.scene.attachments import Attachment
from warp_contact.scene.materials import Corotated, NeoHookean, Rigid, SpringNetwork
from warp_contact.scene.mesh import MeshError, TetMesh
from warp_contact.scene.scene import Body, Scene
from warp_contact.scene.shapes import box, cylinder, dish, sphere
from warp_contact.scene.shell import heightfield, shell
from warp_contact.scene.surface import Surface
from warp_contact.simulation import Simulation
from warp_contact.step.response import ContactSurface, Penalty, PredictedForce, VirtualSurface
from warp_contact.usd.writer import UsdWriter

__all__ = [
    "Attachment",
    "Body",
    "ContactArrays",
    "ContactSurface",
    "Contacts",
    "Corotated",
    "Measure",
    "MeshError",
    "NeoHookean",
    "PairForce",
    "Penalty",
    "PredictedForce",
    "Rigid",
    "Scene",
    "Simulation",
    "SimulationError",
    "SpringNetwork",
    "Surface",
    "TetMesh",
    "UsdWriter",
    "VirtualSurface",
    "box",
    "cylinder",
    "dish",
    "heightfield",
    "shell",
    "sphere",
    "sweep",
]
__version__ = "0.1.0"
