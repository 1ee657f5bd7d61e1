"""The plan of a feature of any kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from graspe_data.simulation.world.feature import Feature, Region
from graspe_data.simulation.world.kinds.any_kind import AnyKind
from graspe_data.simulation.world.kinds.backdrop import (
    Ceiling,
    Treeline,
    plan_ceiling,
    plan_treeline,
)
from graspe_data.simulation.world.kinds.blobs import Boulder, Rock, plan_blobs
from graspe_data.simulation.world.kinds.bush import Bush, plan_bushes
from graspe_data.simulation.world.kinds.curtain import Curtain, plan_curtains
from graspe_data.simulation.world.kinds.ditch import Ditch, plan_ditches
from graspe_data.simulation.world.kinds.fence import Fence, plan_fences
from graspe_data.simulation.world.kinds.glass_wall import GlassWall, plan_glass_walls
from graspe_data.simulation.world.kinds.hanging_leaves import HangingLeaves, plan_hanging_leaves
from graspe_data.simulation.world.kinds.patch import Litter, Mud, Paint, Water, plan_patches
from graspe_data.simulation.world.kinds.pillar import Pillar, plan_pillars
from graspe_data.simulation.world.kinds.stump import Stump, plan_stumps
from graspe_data.simulation.world.kinds.tall_grass import TallGrass, plan_tall_grass
from graspe_data.simulation.world.kinds.tree import Tree, plan_trees
from graspe_data.simulation.world.kinds.vine import Vine, plan_vines
from graspe_data.simulation.world.kinds.wall import Doorway, Wall, plan_doorways, plan_walls
from graspe_data.simulation.world.plan import Plan, Spots
from graspe_data.simulation.world.world import Ground

PLANNERS: dict[type[Feature], Callable[[Any, Spots, Ground, np.random.Generator], Plan]] = {
    Tree: plan_trees,
    HangingLeaves: plan_hanging_leaves,
    Bush: plan_bushes,
    TallGrass: plan_tall_grass,
    Vine: plan_vines,
    Rock: plan_blobs,
    Boulder: plan_blobs,
    Stump: plan_stumps,
    Mud: plan_patches,
    Water: plan_patches,
    Ditch: plan_ditches,
    Litter: plan_patches,
    Paint: plan_patches,
    Fence: plan_fences,
    Wall: plan_walls,
    Doorway: plan_doorways,
    GlassWall: plan_glass_walls,
    Pillar: plan_pillars,
    Curtain: plan_curtains,
}


def plan_feature(
    feature: AnyKind,
    spots: Spots,
    ground: Ground,
    arena: Region,
    generator: np.random.Generator,
) -> Plan:
    """Draw a feature on its spots; those that close the view go by the arena."""
    if isinstance(feature, Ceiling):
        return plan_ceiling(feature, arena)
    if isinstance(feature, Treeline):
        return plan_treeline(feature, arena, generator)
    return PLANNERS[type(feature)](feature, spots, ground, generator)
