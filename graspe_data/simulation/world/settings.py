"""The settings of a world."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from graspe_data.manifest import Settings, Share
from graspe_data.simulation.world.feature import Feature, LineFeature, Region, RoundFeature
from graspe_data.simulation.world.ground import GroundSettings
from graspe_data.simulation.world.kinds.any_kind import AnyKind
from graspe_data.simulation.world.kinds.ditch import Ditch
from graspe_data.simulation.world.looks import Looks
from graspe_data.simulation.world.materials import MATERIALS, Effect, MaterialName

Side = Annotated[float, Field(ge=4, le=200)]


class MaterialChange(Settings):
    """What is different about a material in this world; None leaves it as it is."""

    colour: tuple[Share, Share, Share] | None = None
    """Diffuse albedo, linear RGB."""
    contrast: Share | None = None
    """How far the texture varies the colour."""
    grain: Annotated[float, Field(gt=0, le=10)] | None = None
    """Size of the texture in metres."""
    reflectivity: Share | None = None
    """Of a lidar beam that hits squarely."""
    translucency: Share | None = None
    """Share of light that passes a leaf."""
    transmission: Share | None = None
    """Share of light or of a beam that goes straight through."""
    effect: Effect | None = None
    """On a robot that touches it."""
    strength: Annotated[float, Field(gt=0, le=5)] | None = None
    """Of a changed effect: share of speed left, metres of give, or metres of height."""

    @model_validator(mode="after")
    def _strong_enough(self) -> Self:
        needs = self.effect in ("slows", "stumbles", "entangles")
        if needs and self.strength is None:
            raise ValueError(f"an effect changed to {self.effect!r} needs a strength")
        return self


class WorldSettings(Settings):
    """A world: an arena around x = y = 0 with a ground, and what stands on it."""

    length: Side = 40.0
    """Of the arena along x, metres: x from -length / 2 to length / 2."""
    width: Side = 30.0
    """Of the arena along y, metres: y from -width / 2 to width / 2."""
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the robot begins: x, y in metres and yaw in rad."""
    start_clearance: Annotated[float, Field(ge=0, le=20)] = 1.5
    """Metres round the start without anything that stops, entangles or stumbles."""
    clearance: Annotated[float, Field(ge=0, le=20)] = 1.2
    """Metres between scattered things and others that stop or entangle."""
    ground: GroundSettings = GroundSettings()
    """The ground under everything."""
    features: Annotated[tuple[AnyKind, ...], Field(max_length=64)] = ()
    """What stands on it."""
    looks: Looks = "typical"
    """Colours and reflectivities as of things of their kind, or drawn apart from what things do."""
    materials: dict[MaterialName, MaterialChange] = Field(default_factory=dict)
    """What is different about materials in this world."""

    @property
    def arena(self) -> Region:
        """Lowest x, lowest y, highest x, highest y in metres."""
        return (-self.length / 2, -self.width / 2, self.length / 2, self.width / 2)

    @model_validator(mode="after")
    def _no_faster_than_free(self) -> Self:
        for name, change in self.materials.items():
            slows = (change.effect or MATERIALS[name].effect) == "slows"
            if slows and change.strength is not None and change.strength > 1:
                raise ValueError(
                    f"materials.{name}.strength: of what slows it is a share of the speed, at most "
                    f"1; found {change.strength:g}"
                )
        return self

    @model_validator(mode="after")
    def _ditches_show(self) -> Self:
        for index, feature in enumerate(self.features):
            if isinstance(feature, Ditch) and self.ground.cell > feature.width / 3:
                raise ValueError(
                    f"features.{index}.ditch.width: {feature.width:g} m is narrower than three "
                    f"cells of the ground, {self.ground.cell:g} m each: widen it, or lower "
                    "ground.cell"
                )
        return self

    @model_validator(mode="after")
    def _inside(self) -> Self:
        self._check("start", self.start[:2])
        for index, feature in enumerate(self.features):
            if isinstance(feature, Feature):
                self._check_feature(f"features.{index}.{feature.kind}", feature)
        return self

    def _check_feature(self, where: str, feature: Feature) -> None:
        if feature.within is not None:
            self._check(f"{where}.within", feature.within[:2])
            self._check(f"{where}.within", feature.within[2:])
        if isinstance(feature, RoundFeature):
            for index, place in enumerate(feature.at):
                self._check(f"{where}.at.{index}", place)
        if isinstance(feature, LineFeature):
            for index, place in enumerate(end for line in feature.lines for end in line):
                self._check(f"{where}.lines.{index // 2}", place)

    def _check(self, where: str, place: tuple[float, float]) -> None:
        low_x, low_y, high_x, high_y = self.arena
        if not (low_x <= place[0] <= high_x and low_y <= place[1] <= high_y):
            raise ValueError(
                f"{where}: ({place[0]:g}, {place[1]:g}) lies outside of the arena, x {low_x:g} to "
                f"{high_x:g} and y {low_y:g} to {high_y:g}: move it, or change length or width"
            )
