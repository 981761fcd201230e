"""What every error is, how large at strength 1, and where that figure is from: for people.

"Data sheet" is InvenSense PS-MPU-9250A-01 rev. 1.0 (2014); its limits are taken as three standard
deviations. "Thesis" is the doctoral thesis that the glove is from, chapter 4: 20 sensors of this
kind. "12 units" are static recordings of so many other MPU-9250. "Ours" is judged, not measured.
"""

from __future__ import annotations

from typing import NamedTuple


class Source(NamedTuple):
    """A source of error.

    Attributes:
        name: As in `strengths.Imperfections`.
        what: What it is.
        size: How large at strength 1; "sd" is the standard deviation over sensors and axes.
        source: Where that is from.
    """

    name: str
    what: str
    size: str
    source: str


TABLE = (
    Source(
        "white_noise",
        "White noise of gyroscope and accelerometer",
        "gyroscope 0.0062 to 0.0069 deg/√s by sensor, accelerometer 251 µg√s (355 µg/√Hz) ± 5 %",
        "thesis, table 4.1 (gyroscope); 12 units (accelerometer); data sheet: 0.0071 and 212",
    ),
    Source(
        "bias",
        "What gyroscope and accelerometer of a unit read at rest, warm",
        "sd 1.18 deg/s; 10 mg",
        "12 units; ours, one calibration by hand within the data sheet's 60 mg",
    ),
    Source("turn_on_bias", "The same, anew at every switching on", "sd 0.1 deg/s; 1 mg", "ours"),
    Source(
        "random_walk",
        "Biases that wander",
        "gyroscope 1.41e-4 to 6.15e-4 deg/s^1.5, accelerometer 1.1e-6 to 8.7e-6 g/√s, by sensor",
        "thesis, table 4.1; evenly over the logarithm: ours",
    ),
    Source(
        "scale",
        "Scale of gyroscope and accelerometer",
        "sd 1 % an axis",
        "thesis, 4.2.5 (1 % between gyroscopes); data sheet: 3 %",
    ),
    Source(
        "misalignment",
        "Axes of gyroscope and accelerometer neither square nor along the chip's",
        "sd 0.67 % (0.38 deg) between any two",
        "data sheet: cross-axis sensitivity 2 %",
    ),
    Source(
        "g_sensitivity",
        "What gyroscopes read of acceleration",
        "sd 0.1 deg/s/g between any two axes",
        "data sheet of the MPU-6050 (PS-MPU-6000A-00), its predecessor",
    ),
    Source(
        "temperature",
        "Warming up after switching on, and biases that go with it",
        "7 K to 31 °C, with a time constant of 4 min; sd 0.08 deg/s/K, 0.5 mg/K",
        "data sheet: ±30 deg/s over 125 K, 1.5 mg/K; warming: ours",
    ),
    Source(
        "saturation",
        "Readings end at the range; 2: at half of it",
        "±2000 deg/s, ±8 g, ±4912 µT",
        "data sheet, and the ranges the glove sets",
    ),
    Source(
        "quantisation",
        "Readings are whole counts; 2: every other one",
        "0.061 deg/s, 0.24 mg, 0.15 µT",
        "data sheet: 16 bit",
    ),
    Source("mag_noise", "Noise of a magnetometer's reading", "sd 0.6 µT", "ours: four counts"),
    Source(
        "hard_iron",
        "Magnetised parts of the board, after calibration of the magnetometers",
        "sd 1 µT an axis",
        "ours",
    ),
    Source(
        "soft_iron",
        "Gain of a magnetometer, and of its axes against each other",
        "sd 10 %; 2 %",
        "thesis, 4.2.5 (10 % between compasses, offsets calibrated); ours",
    ),
    Source(
        "mag_hold",
        "Magnetometers read anew at their own rate; 2: at half of it",
        "100 Hz",
        "data sheet",
    ),
    Source(
        "compass_scatter",
        "Axes of the magnetometer turned against the accelerometer's",
        "headings scatter by 4.48 deg (sd) at the flat hand, in Kyoto's field",
        "thesis, 4.2.6",
    ),
    Source(
        "skew",
        "Readings older than their stamp, each sensor's by its own share",
        "0 to 1 ms",
        "data sheet: chips sample at 1 kHz by their own clocks; that ages stay: ours",
    ),
    Source("clock_drift", "The device's clock is fast or slow", "sd 20 ppm", "ours: a crystal"),
    Source(
        "jitter",
        "Stamps scatter about the readings",
        "sd 10 µs, at most a fifth of the period",
        "ours",
    ),
    Source("lost_packets", "Packets lost on the line", "0.5 %, four in a row in the mean", "ours"),
    Source("damaged_packets", "Packets with a wrong byte", "0.05 %", "ours"),
    Source(
        "dying_sensor",
        "One sensor loses contact, ever oftener; 2: in half the time",
        "first after 15 s or later, for good after 60 s",
        "ours",
    ),
    Source(
        "slide",
        "Skin slides with the joints beside it; the forearm's lags behind its rotation",
        "1.5 mm/rad for each joint (sd a third); lag 60 % at the elbow, none at the wrist",
        "ours",
    ),
    Source(
        "rock",
        "Boards pitch as joints bend",
        "sd 1.2 deg for 45 deg of a joint: a PIP angle errs by 3.6 deg RMS",
        "Metcalf et al. 2020: skin markers against computed tomography, below 4 deg",
    ),
    Source(
        "wobble",
        "Boards swing after impacts",
        "18 Hz, forearm 12 Hz (sd a tenth), damping ratio 0.25, 1.9 deg of tilt for a mm",
        "ours",
    ),
    Source(
        "board_slip",
        "The glove slips once, 10 to 40 s after the start, within a second",
        "sd 1.5 deg, 1 mm about and along each axis",
        "ours",
    ),
    Source(
        "mounting",
        "How the glove sits on this person today",
        "sd 4 deg about x and z, 6 deg about the bone; 2, 3 and 1 mm",
        "ours",
    ),
    Source("magnetic_gradient", "The building's field changes with place", "sd 3 µT/m", "ours"),
    Source(
        "desk_edge",
        "A steel rail under the desk's edge, 8 cm below the elbow",
        "pieces of 0.15 m, each with sd 0.15 A m² an axis",
        "ours",
    ),
    Source(
        "magnet",
        "A magnet on the desk, 15 to 25 cm beside the hand",
        "0.4 A m², a neodymium disk of 10 mm",
        "ours",
    ),
)
"""In the order of `strengths.NAMES`."""
