"""How sure the filter is of what the plots show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from app.panels.plots import _data, _edges
from app.shown.channels import plots_of, sds_of
from app.shown.live import extended
from app.shown.review import Review, opened
from app.studio import Studio
from app.views.page import curves_of
from handstudio.pipeline import Motion


def _told(motion: Motion) -> Motion:
    """Each sensor is as sure as its number says, of itself and relative to the one before."""
    sd = np.empty(motion.sd_rad.shape, dtype=np.float32)
    sd[..., 0] = 9.0
    sd[..., 1] = np.deg2rad(np.arange(sd.shape[1]))
    return replace(motion, sd_rad=sd)


def test_a_curve_is_as_sure_as_the_sensor_beyond_its_joint(review: Review) -> None:
    layout = review.setup.layout
    sds = sds_of(review.setup, _told(review.motion[:3]))
    labels = [curve.label for plot in plots_of(layout) for curve in plot.curves]
    assert sds.shape == (3, len(labels))
    first = plots_of(layout)[0]
    np.testing.assert_allclose(sds[:, labels.index("index")], layout.drivers["index_proximal"])
    assert first.curves[1].label == "index"
    np.testing.assert_allclose(sds[:, labels.index("wrist flexion")], layout.drivers["hand"])


def test_a_filter_that_does_not_tell_has_no_band(review: Review, studio: Studio) -> None:
    curves = curves_of(replace(studio.state, review=review))
    assert curves is not None
    assert curves.sds is None
    assert _edges(curves, slice(0, 5)) == []


def test_bands_are_around_their_curves_and_without_holes(review: Review, studio: Studio) -> None:
    told = _told(review.motion)
    told.sd_rad[:100] = np.inf
    curves = curves_of(replace(studio.state, review=opened(review.take, told)))
    assert curves is not None
    (edges,) = _edges(curves, slice(0, 5))
    values = curves.values[:, :5]
    assert (edges[:, 0::2] >= values).all()
    np.testing.assert_allclose(edges[:, 0::2] - values, values - edges[:, 1::2], atol=1e-9)
    np.testing.assert_array_equal(edges[0, 0::2], values[0])
    columns = _data(curves, slice(0, 5), 40.0)
    assert len(columns) == 1 + 10 + 5 + 1
    assert all(np.isfinite(column).all() for column in columns)


def test_live_angles_have_it_too(review: Review) -> None:
    history = extended(None, review.setup, [_told(review.motion[:200])])
    assert history.sds.shape == history.values.shape
    assert np.isfinite(history.sds).all()
