//! L_EM of one frame alone, with its EM region wherever that is asked for: as the frame's own fit compares it, so that a fit in a
//! window looks at every second cell where the point spread covers several (`motion/thinned.rs`).

use super::frame_em::{EmScratch, FrameEm};
use super::motion::ThinnedViews;
use super::region;
use super::{FitError, Precision, Problem};
use crate::body::Pppr;
use crate::config::{FitConfig, Parameterization};

/// The maps of a frame, to be compared with bodies in many places.
pub struct FrameEmLoss<'a> {
    problem: &'a Problem,
    config: FitConfig,
    precision: Precision,
    thinned: Option<ThinnedViews<'a>>,
}

/// L_EM within the EM region of one place.
pub struct EmAround<'a> {
    frame: &'a FrameEmLoss<'a>,
    em: FrameEm,
}

impl<'a> FrameEmLoss<'a> {
    /// Of the frame of `problem`, for persons who are about as far away as those of `params`.
    pub fn new(problem: &'a Problem, config: FitConfig, precision: Precision, params: &Pppr) -> Self {
        let problem = problem.under(&config);
        let in_window = config.parameterization == Parameterization::Motion;
        let thinned = in_window.then(|| ThinnedViews::new(problem, &config, params));
        Self { problem, config, precision, thinned }
    }

    /// Within the EM region around the persons of `params`.
    ///
    /// # Errors
    /// Where `params` has the wrong sizes or a position that is not finite.
    pub fn around(&self, params: &Pppr) -> Result<EmAround<'_>, FitError> {
        let Self { problem, config, precision, thinned } = self;
        problem.check(params)?;
        let views = thinned.as_ref().map_or(&problem.views[..], ThinnedViews::views);
        let (regions, _) = region::regions(views, config.em_region, &region::centres(params))?;
        let em = match thinned {
            Some(thinned) => thinned.compared(None, &regions, (config, *precision), None),
            None => FrameEm::new(&problem.measured(config), &regions, config, *precision),
        };
        Ok(EmAround { frame: self, em })
    }
}

impl EmAround<'_> {
    /// L_EM at `params`; `scratch` is room that is used again.
    pub fn loss(&self, params: &Pppr, scratch: &mut EmScratch) -> f64 {
        let FrameEmLoss { problem, config, precision, .. } = self.frame;
        self.em.loss_in((&problem.radar, config), *precision, params, scratch)
    }
}
