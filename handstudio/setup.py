"""The setup: everything that decides the output besides the events. Saved with every take."""

from __future__ import annotations

import hashlib
from typing import TypeAlias

import msgspec

from handstudio.calibration.correction import CorrectionFilter
from handstudio.calibration.device import DeviceCalibration
from handstudio.calibration.subject import SubjectCalibration
from handstudio.errors import CalibrationError, SetupError
from handstudio.fusion.chain_filter import Filter2, Filter3, Filter4
from handstudio.fusion.filter1 import Filter1
from handstudio.fusion.raw import RawFilter
from handstudio.fusion.tree_filter import TreeFilter
from handstudio.fusion.vqf_filter import VqfFilter
from handstudio.hand.skeleton import ADULT_HAND_LENGTH_M, HandType
from handstudio.layout import Layout, divisible, glove, with_hand_type
from handstudio.protocol.packets import Description, sensor_name
from handstudio.samples import Ranges

AnyFilter: TypeAlias = TreeFilter | VqfFilter | RawFilter | Filter1 | Filter2 | Filter3 | Filter4
"""The filters a setup can name; each is a struct with a tag of its own."""

FILTERS: dict[str, AnyFilter] = {
    "tree": TreeFilter(),
    "vqf": VqfFilter(),
    "raw": RawFilter(),
    "filter1": Filter1(),
    "filter2": Filter2(),
    "filter3": Filter3(),
    "filter4": Filter4(),
}


NOMINAL_ZERO = "nominal mounting: sensor axes taken as segment axes"
NO_CALIBRATION = "none (mean adult proportions scaled by hand length)"


class Device(msgspec.Struct, frozen=True):
    """What a take knows of the device it came from."""

    name: str
    serial_number: str
    firmware: str
    protocol: int


class JointGeometry(msgspec.Struct, frozen=True):
    """Where a joint of a layout that is no hand lies, and how it turns, as its sensors see it.

    Attributes:
        joint: Its name in the layout.
        t_parent_joint_m: Its centre from the parent's sensor, in that sensor's frame.
        t_child_joint_m: Its centre from the child's sensor, in that one's.
        sd_m: How well they are known.
        parent_axis, child_axis: Unit vectors in the sensors: of a hinge its axis on both sides; of
            a joint of two axes the first in the parent and the second in the child; None: unknown.
        axis_sd_rad: How well they are known.
    """

    joint: str
    t_parent_joint_m: tuple[float, float, float]
    t_child_joint_m: tuple[float, float, float]
    sd_m: float = 0.005
    parent_axis: tuple[float, float, float] | None = None
    child_axis: tuple[float, float, float] | None = None
    axis_sd_rad: float = 0.05


class HandModel(msgspec.Struct, frozen=True):
    """The hand that is shown: of mean proportions, by its length; the layout divides its palm."""

    hand_length_m: float = ADULT_HAND_LENGTH_M


class Setup(msgspec.Struct, frozen=True):
    """Everything that decides the output besides the events.

    Attributes:
        layout: Sensors and joints.
        rate_hz: Nominal sampling rate.
        magnetometer_rate_hz: How often magnetometers read anew; None: with every sample, or never.
        ranges: What the device's counts stand for; None for imports, which are in SI.
        decoder: Name of the decoder of the recorded bytes; None for imports.
        filter: Which filter, with its parameters.
        hand: The hand model.
        device: Where the data came from.
        zero: What joint angles are measured from.
        calibration: Identity of the subject calibration in use.
        sensors: Errors of the sensors, taken off the readings before anything else.
        heading_rad: By how much each sensor's orientation is turned about the vertical after
            fusion, in the order of the layout (4.22); empty: not at all.
        subject: The wearer's own hand, and how the glove sits on it; None: ``hand`` and the maker.
        joints: Of a layout that is no hand: where its joints are, as far as that is known.
        mean_rates: Rates are means since the sample before, not of the instant.
        correction: The thesis's filter of sensor outputs (4.10 to 4.17), before fusion; None: none.
            It lags, and takes no bias off: to compare.
        smooth: Let a recorded take be fused with its future; nothing live does.
    """

    layout: Layout
    rate_hz: float
    magnetometer_rate_hz: float | None = None
    ranges: Ranges | None = None
    decoder: str | None = None
    filter: AnyFilter = VqfFilter()
    hand: HandModel = HandModel()
    device: Device | None = None
    zero: str = NOMINAL_ZERO
    calibration: str = NO_CALIBRATION
    sensors: DeviceCalibration | None = None
    heading_rad: tuple[float, ...] = ()
    subject: SubjectCalibration | None = None
    joints: tuple[JointGeometry, ...] = ()
    mean_rates: bool = False
    smooth: bool = False
    correction: CorrectionFilter | None = None

    @property
    def key(self) -> str:
        """Short hash of the whole setup."""
        return hashlib.sha256(encode(self)).hexdigest()[:16]


def for_device(
    description: Description, decoder: str, hand: HandModel | None = None, side: str | None = None
) -> Setup:
    """The setup of a device that described itself, everything else at its default.

    Args:
        description: What the device says.
        decoder: The decoder that understood it.
        hand: The wearer's hand; mean adult unless given.
        side: Which hand, where the device does not know.
    """
    names = tuple(sensor_name(number) for number in description.sensors)
    known = side if description.side == "unknown" and side else description.side
    return Setup(
        layout=glove(known, names),
        rate_hz=float(description.rate_hz),
        magnetometer_rate_hz=float(description.magnetometer_rate_hz) or None,
        ranges=Ranges.of(description),
        decoder=decoder,
        hand=hand or HandModel(),
        device=Device(
            description.name,
            description.serial_number,
            description.firmware,
            description.protocol,
        ),
    )


def calibrated(
    setup: Setup,
    *,
    subject: SubjectCalibration | None = None,
    sensors: DeviceCalibration | None = None,
) -> Setup:
    """A setup with what is known of wearer and glove; None: nothing, as the maker meant it.

    The palm of a glove's layout is divided as the calibration has it, where its sensors allow that.

    Raises:
        CalibrationError: the calibration is of the other hand.
    """
    if subject is not None and subject.side != setup.layout.side:
        raise CalibrationError(
            "The calibration {id} is of a {side} hand; this glove is on a {other} one.",
            "Calibrate this hand, or mirror the calibration: handstudio mirror.",
            id=subject.id,
            side=subject.side,
            other=setup.layout.side,
        )
    layout = setup.layout
    if subject is not None and subject.hand_type != layout.hand_type and divisible(layout):
        layout = with_hand_type(layout, subject.hand_type)
    return msgspec.structs.replace(
        setup,
        layout=layout,
        subject=subject,
        sensors=sensors,
        zero=NOMINAL_ZERO if subject is None else "flat hand, functional axes",
        calibration=NO_CALIBRATION if subject is None else subject.id,
    )


def divided(setup: Setup, hand_type: HandType) -> Setup:
    """The setup of a hand whose palm is divided otherwise.

    Raises:
        CalibrationError: the hand is calibrated, and as another type.
        LayoutError: the sensors cannot tell a hand of that type.
    """
    if setup.subject is not None and setup.subject.hand_type != hand_type:
        raise CalibrationError(
            "The calibration {id} is of a hand of type {own}, not {wanted}.",
            "Calibrate again with --hand-type {wanted}, or process with --calibration none.",
            id=setup.subject.id,
            own=setup.subject.hand_type,
            wanted=hand_type,
        )
    return msgspec.structs.replace(setup, layout=with_hand_type(setup.layout, hand_type))


def smoothing(setup: Setup) -> Setup:
    """The setup whose takes are fused with their future in mind, by the tree filter."""
    known = setup.filter if isinstance(setup.filter, TreeFilter) else TreeFilter()
    return msgspec.structs.replace(setup, filter=known, smooth=True)


def filter_named(name: str) -> AnyFilter:
    """A filter with its default parameters.

    Raises:
        SetupError: there is none of this name.
    """
    if name not in FILTERS:
        raise SetupError(
            "There is no filter {name!r}.",
            "Choose one of: {known}.",
            name=name,
            known=", ".join(FILTERS),
        )
    return FILTERS[name]


def encode(setup: Setup) -> bytes:
    """JSON, with the same bytes for equal setups."""
    return msgspec.json.encode(setup, order="deterministic")
