"""What a certificate says: how far places on an engine are from those of a witness."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ...backends.repair_record import Repair
from ...measures import largest_or_inf
from ...show.blocks import only_on_pages
from ...witness import OWN_READING
from ..runs.provenance import Provenance

TOLERANCE = 1e-12  # metres, and entries of the rotation matrix
SAME_FRAME = 1e-9  # metres and radians; files write frames with fewer digits than poses

CertificateVerdict = Literal[
    "different frames", "no common body", "disagrees", "agrees", "same place"
]


@dataclass(frozen=True)
class FrameOffset:
    """Offset from the engine's frame of a name to the witness's.

    Attributes:
        distance: Between the two origins [m].
        angle: Between the two orientations [rad].
    """

    distance: float
    angle: float

    @property
    def same(self) -> bool:
        """Tell whether the two are one frame."""
        return self.distance <= SAME_FRAME and self.angle <= SAME_FRAME


@dataclass(frozen=True)
class TipGap:
    """Gap between where an engine puts a site or body, and where the witness puts it.

    The differences are None where the two frames are not the same, or are on no common body: they
    would say nothing about the engine then.

    Attributes:
        site: The site or body on the engine.
        kind: Which of the two it is.
        witness_frame: Its name for the witness.
        body: The body that it is, or that carries it, on the engine.
        frames: Offset between the two frame definitions; None where they are on no common body
            and the offset between the poses is not steady.
        default_pose: (3,) Where it is at the model's default qpos on the engine [m].
        position_worst: Largest difference in position over all poses [m].
        position_median: Median difference in position [m].
        rotation_worst: Largest entry of the difference of the rotation matrices, over all poses.
        rotation_median: Median over the poses of the largest entry.
        tolerance: Up to which both worst differences are none [m, and 1].
    """

    site: str
    kind: Literal["site", "body"]
    witness_frame: str
    body: str
    frames: FrameOffset | None
    default_pose: tuple[float, ...]
    position_worst: float | None = None
    position_median: float | None = None
    rotation_worst: float | None = None
    rotation_median: float | None = None
    tolerance: float = field(default=TOLERANCE, metadata={"json": False})

    @property
    def worst(self) -> float:
        """Return the larger worst difference; infinite without one, or if it is no number."""
        if self.position_worst is None or self.rotation_worst is None:
            return math.inf
        return largest_or_inf(np.array([self.position_worst, self.rotation_worst]))

    @property
    def agrees(self) -> bool:
        """Tell whether both worst differences are within the tolerance."""
        return self.worst <= self.tolerance


@dataclass(frozen=True)
class CommonBody:
    """Body of the robot that both files have.

    Attributes:
        body: Its name on the engine.
        witness_body: Its name for the witness.
    """

    body: str
    witness_body: str


@dataclass(frozen=True)
class RenamedJoint:
    """A joint that goes by another name in the witness's file.

    Attributes:
        joint: Its name on the engine.
        witness_joint: Its name for the witness: one kind, one place, one axis.
    """

    joint: str
    witness_joint: str


@dataclass(frozen=True)
class FingertipResult:
    """Certificate of an engine: its poses of sites or bodies against those of a witness.

    Attributes:
        tips: The gap of each site or body that was compared, the worst first.
        left_out: Sites or bodies that the witness's file does not have.
        relative_to: Body that all places are relative to, on both sides; None where they are those
            in the world. Two files need not put a robot at one place of the world, and in one of
            them its base may float.
        renamed_joints: Joints that go by other names in the witness's file.
        poses: Number of poses that were compared.
        tolerance: What the worst differences must not exceed [m, and entries of a matrix].
        witness_file: The file that the witness read, with its folder.
        grade: `OWN_READING` if Pinocchio's parser read the file, `SAME_READING` if it computed
            from the numbers of the engine's model.
        reason: Why it is not an own reading; "" if it is.
        prepared: What was done to the file's text before Pinocchio read it.
        provenance: What it was computed with, the seed of the poses included.
        site_asked: The site or body that was asked for; None where none was. Then the tips are
            the site gripperframe, or else every body that joints move and that carries no other.
        repairs: Inertias of the file that were balanced, masses that bodies got which have none,
            and meshes that were left out, so that the engine reads it; they have no part in places.
        refusal: Why the engine refuses the file as it is; "" where it does not.
    """

    tips: tuple[TipGap, ...]
    left_out: tuple[str, ...]
    relative_to: CommonBody | None
    renamed_joints: tuple[RenamedJoint, ...]
    poses: int
    tolerance: float
    witness_file: str
    grade: str
    reason: str
    prepared: tuple[str, ...]
    provenance: Provenance
    site_asked: str | None = None
    repairs: tuple[Repair, ...] = ()
    refusal: str = ""

    @property
    @only_on_pages
    def worst_tip(self) -> TipGap:
        """Return the worst gap, which JSON shows beside the list of all."""
        return self.tips[0]

    @property
    def site(self) -> str:
        """Return the site or body of the worst gap."""
        return self.worst_tip.site

    @property
    def witness_frame(self) -> str:
        """Return the witness's name for it."""
        return self.worst_tip.witness_frame

    @property
    def body(self) -> str:
        """Return the body that it is, or that carries it."""
        return self.worst_tip.body

    @property
    def frames(self) -> FrameOffset | None:
        """Return the offset between its two frame definitions."""
        return self.worst_tip.frames

    @property
    def default_pose(self) -> tuple[float, ...]:
        """Return where it is (3,) at the model's default qpos on the engine [m]."""
        return self.worst_tip.default_pose

    @property
    def position_worst(self) -> float | None:
        """Return its largest difference in position [m]."""
        return self.worst_tip.position_worst

    @property
    def position_median(self) -> float | None:
        """Return its median difference in position [m]."""
        return self.worst_tip.position_median

    @property
    def rotation_worst(self) -> float | None:
        """Return the largest entry of its difference of the rotation matrices."""
        return self.worst_tip.rotation_worst

    @property
    def rotation_median(self) -> float | None:
        """Return the median over the poses of the largest entry."""
        return self.worst_tip.rotation_median

    @property
    def agrees(self) -> bool:
        """Tell whether all gaps are within the tolerance."""
        return all(gap.agrees for gap in self.tips)

    @property
    @only_on_pages
    def has_one_tip(self) -> bool:
        """Tell whether one site or body was compared, and not several."""
        return len(self.tips) == 1

    @property
    def chosen(self) -> tuple[str, ...]:
        """Return the names of the sites or bodies that were chosen; none where one was asked for.

        They are in the order of their names.
        """
        if self.site_asked is not None:
            return ()
        return tuple(sorted([*(gap.site for gap in self.tips), *self.left_out]))

    @property
    @only_on_pages
    def kind(self) -> Literal["site", "body"]:
        """Return which of the two it is."""
        return self.worst_tip.kind

    @property
    @only_on_pages
    def is_own_reading(self) -> bool:
        """Tell whether the witness read the file with its own parser."""
        return self.grade == OWN_READING

    @property
    @only_on_pages
    def has_other_names(self) -> bool:
        """Tell whether a site or body goes by another name for the witness."""
        return any(gap.site != gap.witness_frame for gap in self.tips)

    @property
    @only_on_pages
    def verdict(self) -> CertificateVerdict:
        """Return what the certificate says.

        Returns:
            "different frames": The files give one name to two frames; nothing was compared.
            "no common body": The two frames are on different bodies; nothing was compared.
            "disagrees": A difference exceeds the tolerance.
            "agrees": None does, and the witness read the file itself.
            "same place": None does, from the same numbers; the reading was not checked.
        """
        if self.frames is None:
            return "no common body"
        if not self.frames.same:
            return "different frames"
        if not self.agrees:
            return "disagrees"
        return "agrees" if self.is_own_reading else "same place"
