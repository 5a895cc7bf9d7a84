//! L_EM of one frame alone, with its EM region wherever that is asked for: as the frame's own fit compares it, which in a window is
//! in fewer cells (`reduced.rs`).

use super::frame_em::{EmScratch, FrameEm};
use super::motion::ReducedViews;
use super::region;
use super::{FitError, Precision, Problem};
use crate::body::Pppr;
use crate::config::{FitConfig, Parameterization};

/// The maps of a frame, to be compared with bodies in many places.
pub struct FrameEmLoss<'a> {
    problem: &'a Problem,
    config: FitConfig,
    precision: Precision,
    reduced: Option<ReducedViews<'a>>,
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
        let reduced = in_window.then(|| ReducedViews::new(problem, &config, params));
        Self { problem, config, precision, reduced }
    }

    /// Within the EM region around the persons of `params`.
    ///
    /// # Errors
    /// Where `params` has the wrong sizes or a position that is not finite.
    pub fn around(&self, params: &Pppr) -> Result<EmAround<'_>, FitError> {
        let Self { problem, config, precision, reduced } = self;
        problem.check(params)?;
        let views = reduced.as_ref().map_or(&problem.views[..], ReducedViews::views);
        let (regions, _) = region::regions(views, config.em_region, &region::centres(params))?;
        let em = match reduced {
            Some(reduced) => reduced.compared(None, &regions, (config, *precision), None),
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
