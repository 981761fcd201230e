"""What findings say to a person, and what to do next."""

from __future__ import annotations

import numpy as np

from handstudio.errors import TrackError
from handstudio.trackers.findings import TrackFinding


def said(finding: TrackFinding) -> TrackError:  # noqa: PLR0911 - a list
    """The finding in words; to be shown, or to be raised where it stops everything."""
    name, amount, at_s = finding.track, finding.amount, 1e-6 * finding.since_us
    match finding.kind:
        case "no_clock":
            return TrackError(
                "{name}: {share:.0f} % of its instants are not later than the one before.",
                "Export it with a time column in seconds.",
                name=name,
                share=100.0 * amount,
            )
        case "never_seen":
            return TrackError(
                "{name} was never seen.",
                "Check its cable or its markers, and that it is near enough to the tracker.",
                name=name,
            )
        case "frozen":
            return TrackError(
                "{name} told the same pose for {seconds:.1f} s, from {at:.1f} s on.",
                "Those frames are left out. If it happens again, plug the terminal in anew.",
                name=name,
                seconds=amount,
                at=at_s,
            )
        case "hemisphere":
            return TrackError(
                "{name} jumped {count:.0f} times to the opposite side of the transmitter, first "
                "at {at:.1f} s.",
                "It was put back. Choose the half of the room in the tracker's own settings, and "
                "stay on that side.",
                name=name,
                count=amount,
                at=at_s,
            )
        case "upside_down":
            return TrackError(
                "{name} lies upside down: its z is {angle:.0f} deg from up at the start.",
                "Joints are found all the same. Turn it over where its attitude matters.",
                name=name,
                angle=float(np.rad2deg(amount)),
            )
        case "drop_outs":
            return TrackError(
                "{name} was not seen for {share:.0f} % of the time.",
                "Bring hand and tracker nearer, and keep markers in sight of the cameras.",
                name=name,
                share=100.0 * amount,
            )
        case "exchanged":
            return TrackError(
                "{name} took each other's place {count:.0f} times, first at {at:.1f} s.",
                "They were exchanged back. Make their marker clusters more unlike.",
                name=name,
                count=amount,
                at=at_s,
            )
        case "swapped":
            return TrackError(
                "{name}: the first turned {ratio:.1f} times as far as the second.",
                "They seem swapped: name the terminal nearer to the hand first.",
                name=name,
                ratio=amount,
            )
        case "metal":
            return TrackError(
                "{name}: the joint moves by {millimetres:.1f} mm with the place in the room.",
                "Take metal away from tracker and hand, or bend the finger nearer to the "
                "transmitter.",
                name=name,
                millimetres=1e3 * amount,
            )
