"""The health of a take: what was kept with it, or what its bytes still tell."""

from __future__ import annotations

from handstudio.health.record import TakeHealth
from handstudio.health.watch import Watch
from handstudio.recording.take import Take


def health_of_take(take: Take) -> TakeHealth:
    """What was kept when it was recorded; of a recovered or older take, what can be computed.

    Raises:
        TakeError: it has to be computed, and the file is damaged.
    """
    if take.summary is not None and take.summary.health is not None:
        return take.summary.health
    return recomputed_health(take)


def recomputed_health(take: Take) -> TakeHealth:
    """The health that is in the recorded bytes: everything but latency.

    It equals what was kept live. An import has no arrivals, so no jitter and no drift either.

    Raises:
        TakeError: the file is damaged.
        SetupError: what the decoder knew at the first byte cannot be read by this version.
    """
    watch = Watch()
    watch.begin(take.header.setup)
    watch.begin_take()
    for arrival_ns, packets, events in take.decoded():
        watch.note(packets, events, arrival_ns)
    health = watch.end_take()
    assert health is not None  # a take was begun
    return health
