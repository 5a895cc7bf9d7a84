//! What is seen of each map: the person or all of it, from frame to frame.

use super::{MapExtent, State};
use crate::radar::View;
use crate::session::Session;
use crate::worker::JobId;

/// Around the person, as a share of the person's extent.
const MARGIN: f32 = 0.25;
/// The least that is seen of a map.
const LEAST: f32 = 0.08;

/// What is seen, and of which fit that was found out.
#[derive(Debug, Default)]
pub(super) struct Focus {
    /// The whole of each map was asked for.
    pub(super) whole: bool,
    /// The fit whose person is in the middle.
    job: Option<JobId>,
}

impl Focus {
    /// The person is looked for anew, and zoomed to, unless the whole was asked for.
    pub(super) fn again(&mut self) {
        self.job = None;
    }
}

impl State {
    /// Keeps the person in the middle from frame to frame: the first time with a margin, then with the zoom that is set.
    pub(super) fn follow(&mut self, session: &Session, views: &[View]) {
        let Some(snapshot) = session.fit.shown.as_ref().filter(|shown| shown.job == session.fit.job) else { return };
        if self.focus.whole || self.focus.job == Some(snapshot.job) || self.highlight.is_some() {
            return;
        }
        let first = self.focus.job.is_none();
        if first || session.view.follow {
            self.show_person(session, views, !first);
        }
        self.focus.job = Some(snapshot.job);
    }

    /// Moves every map to the person; zooms to them too, unless the zoom is kept.
    pub(super) fn show_person(&mut self, session: &Session, views: &[View], keep_zoom: bool) {
        self.windows.resize(views.len(), MapExtent::default());
        for (index, (view, window)) in views.iter().zip(&mut self.windows).enumerate() {
            let Some([min, max]) = person_box(session, view, index) else { continue };
            for axis in 0..2 {
                let extent = max[axis] - min[axis];
                let kept = window.max[axis] - window.min[axis];
                let span = if keep_zoom { kept } else { (extent * (1.0 + 2.0 * MARGIN)).clamp(LEAST, 1.0) };
                let low = (0.5 * (min[axis] + max[axis]) - 0.5 * span).clamp(0.0, 1.0 - span);
                (window.min[axis], window.max[axis]) = (low, low + span);
            }
        }
    }
}

/// Where the person is on a map, picture coordinates: the EM region where it is a part of the map, else around the joints.
fn person_box(session: &Session, view: &View, index: usize) -> Option<[[f32; 2]; 2]> {
    let snapshot = session.fit.shown.as_ref()?;
    let o = crate::app::map_image::Orientation::of(view, session.view.cube);
    let inside = snapshot.masks.get(index).map(|masks| o.mask_picture(view, &masks.inside));
    let region = inside.and_then(|inside| super::overlay::region_box(o.size(view), &inside));
    let covers = |[min, max]: [[f32; 2]; 2]| (0..2).all(|axis| max[axis] - min[axis] > 0.95);
    if let Some(region) = region.filter(|region| !covers(*region)) {
        return Some(o.shown_box(view, region));
    }
    let (mut min, mut max) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
    for (&p, &v) in snapshot.params.positions().iter().zip(snapshot.params.velocities()) {
        let at = o.unit_from_bins(view, &view.bins_of_moving(p, v));
        for axis in 0..2 {
            min[axis] = min[axis].min(at[axis].clamp(0.0, 1.0) as f32);
            max[axis] = max[axis].max(at[axis].clamp(0.0, 1.0) as f32);
        }
    }
    let there = (0..2).all(|axis| min[axis].is_finite() && max[axis] > min[axis]);
    there.then(|| {
        let pad: [f32; 2] = std::array::from_fn(|axis| (max[axis] - min[axis]).max(0.1));
        [
            std::array::from_fn(|axis| (min[axis] - pad[axis]).max(0.0)),
            std::array::from_fn(|axis| (max[axis] + pad[axis]).min(1.0)),
        ]
    })
}
