"""Every kind of feature, told apart by its `kind`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from graspe_data.simulation.world.kinds.backdrop import Ceiling, Treeline
from graspe_data.simulation.world.kinds.blobs import Boulder, Rock
from graspe_data.simulation.world.kinds.bush import Bush
from graspe_data.simulation.world.kinds.curtain import Curtain
from graspe_data.simulation.world.kinds.ditch import Ditch
from graspe_data.simulation.world.kinds.fence import Fence
from graspe_data.simulation.world.kinds.glass_wall import GlassWall
from graspe_data.simulation.world.kinds.hanging_leaves import HangingLeaves
from graspe_data.simulation.world.kinds.patch import Litter, Mud, Paint, Water
from graspe_data.simulation.world.kinds.pillar import Pillar
from graspe_data.simulation.world.kinds.stump import Stump
from graspe_data.simulation.world.kinds.tall_grass import TallGrass
from graspe_data.simulation.world.kinds.tree import Tree
from graspe_data.simulation.world.kinds.vine import Vine
from graspe_data.simulation.world.kinds.wall import Doorway, Wall

AnyKind = Annotated[
    Tree
    | HangingLeaves
    | Bush
    | TallGrass
    | Vine
    | Rock
    | Boulder
    | Stump
    | Mud
    | Water
    | Ditch
    | Litter
    | Paint
    | Fence
    | Wall
    | Doorway
    | GlassWall
    | Pillar
    | Curtain
    | Ceiling
    | Treeline,
    Field(discriminator="kind"),
]
