"""What was found in a scan."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Part:
    """One part found. `T_scene_model` maps the CAD file's frame to the scan's: 4 x 4, in the scan's unit."""

    model_id: str
    T_scene_model: np.ndarray = field(repr=False)
    score: float
    visible_fraction: float
    explained_fraction: float
    explained_area: float  # over what the part shows on average over all views
    violated_fraction: float
    residual: float
    votes: float
    occluded_by: tuple  # indices into Result.parts: take those first
    confidence: float  # that this pose is right, not one of `variants`
    variants: tuple = field(repr=False)  # 4 x 4 each: nearly alike poses that the scan does not rule out
    equivalents: tuple = field(repr=False)  # 4 x 4 each: poses that show the same, where list_equivalents asked
    covariance: np.ndarray = field(repr=False)  # 6 x 6: x, y, z, then rotation about them; scan's unit and radians
    free_directions: np.ndarray = field(repr=False)  # n x 6, same order: motions that the scan hardly resists

    @classmethod
    def of(cls, hypothesis):
        return cls(hypothesis.model_id, matrix_of(hypothesis.pose), hypothesis.score, hypothesis.visible_fraction,
                   hypothesis.explained_fraction, hypothesis.explained_area, hypothesis.violated_fraction,
                   hypothesis.residual, hypothesis.votes,
                   tuple(hypothesis.occluded_by), hypothesis.confidence, tuple(map(matrix_of, hypothesis.variants)),
                   tuple(map(matrix_of, hypothesis.equivalents)), np.array(hypothesis.covariance).reshape(-1, 6),
                   np.array([_motion_of(twist) for twist in hypothesis.free_directions]).reshape(-1, 6))


@dataclass(frozen=True)
class Result:
    """The parts of one scan, best first; when there are none, `warnings` say why."""

    parts: tuple
    warnings: tuple
    stats: object = field(repr=False)  # binpose.v1.DetectStats
    request_id: str = ""
    rejected: tuple = field(default=(), repr=False)  # scored too little; where DetectParams.max_rejected asked for them

    @classmethod
    def of(cls, answer):
        return cls(tuple(map(Part.of, answer.hypotheses)), tuple(answer.warnings), answer.stats, answer.request_id,
                   tuple(map(Part.of, answer.rejected)))


def _motion_of(twist):
    return [*(getattr(twist.translation, axis) for axis in "xyz"), *(getattr(twist.rotation, axis) for axis in "xyz")]


def matrix_of(pose):
    """A pose of the API, position and unit quaternion, as a 4 x 4 matrix."""
    q, p = pose.orientation, pose.position
    x, y, z, w = q.x, q.y, q.z, q.w
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), p.x],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), p.y],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), p.z],
                     [0, 0, 0, 1]])
