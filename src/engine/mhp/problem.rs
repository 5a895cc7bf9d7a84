//! One frame's worth of optimisation problem: radar, skeleton, views and their maps, checked and filled.

use super::context::{Contexts, Neighbour, Reading, TemporalContext, anchors, range_offsets};
use super::frame_em::Measured;
use super::reduced::{ReducedCache, ReducedMaps, Reduction};
use super::sidelobes::Polar;
use super::{FitError, fill_missing};
use crate::body::{Pppr, Skeleton};
use crate::config::{Clutter, EmLoss, FitConfig, FramesAround, RangeOffset, Sidelobes};
use crate::geometry::Vec3;
use crate::radar::{RadarConfig, View, ViewSet};
use std::sync::{Arc, OnceLock};

/// Frames whose ranges are compared at most, with that of the fit.
const FRAMES_COMPARED: usize = 5;

/// Everything a fit needs besides its configuration and its start. Maps are cast to f64 and their missing cells filled
/// (SPEC section 4).
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Chirp and array.
    pub radar: RadarConfig,
    /// Joints, bones and limits.
    pub skeleton: Skeleton,
    /// One view a map.
    pub views: ViewSet,
    /// Whether what stands still was taken away from the maps before: what is left beside a person is sidelobes, no reflectors.
    pub static_removed: bool,
    maps: Vec<Vec<f64>>,
    filled: Vec<usize>,
    neighbours: Vec<Neighbour>,
    /// Whether sidelobes were taken from the maps.
    cleared: bool,
    derived: Derived,
    /// Where cells were erased, which are NaN in the maps here: the same problem with what borders on them in their place.
    patched: Option<Arc<Self>>,
}

/// What follows from a problem's maps, worked out when first asked for. Equal to any other; a copy, whose maps may become others,
/// works it out anew, but for the range offsets: they are the radars'.
#[derive(Debug, Default)]
struct Derived {
    contexts: Contexts,
    reduced: ReducedCache,
    offsets: Arc<OnceLock<Option<Vec<f64>>>>,
    /// The same problem with its range offsets, if any.
    calibrated: OnceLock<Option<Arc<Problem>>>,
    /// The same problem without sidelobes, if there are any.
    cleared: OnceLock<Option<Arc<Problem>>>,
}

impl Clone for Derived {
    fn clone(&self) -> Self {
        Self { offsets: Arc::clone(&self.offsets), ..Self::default() }
    }
}

impl PartialEq for Derived {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Problem {
    /// Checks and fills `maps`, one a view, C-ordered, each as long as the product of its view's bins. Problems of the same
    /// [`ViewSet`] share what its axes decide.
    ///
    /// # Errors
    /// Where there is no view, a view has other than 1 to 3 axes, an axis has no extent, a fixed region lies outside its
    /// axis, a map has the wrong number of cells, or none of them is finite.
    pub fn new(
        radar: RadarConfig,
        skeleton: Skeleton,
        views: impl Into<ViewSet>,
        maps: &[&[f64]],
    ) -> Result<Self, FitError> {
        let views = views.into();
        if views.is_empty() || views.len() != maps.len() {
            return Err(FitError::WrongParameters { what: "maps", got: maps.len(), expected: views.len().max(1) });
        }
        check_skeleton(&skeleton)?;
        views.iter().try_for_each(check_view)?;
        let (maps, filled) = fill(&views, maps)?;
        Ok(Self {
            radar,
            skeleton,
            views,
            static_removed: false,
            maps,
            filled,
            neighbours: Vec::new(),
            cleared: false,
            derived: Derived::default(),
            patched: None,
        })
    }

    /// The problem as fits with this configuration see it: with [`Sidelobes::Removed`] without them, and with [`RangeOffset::Measured`]
    /// the views' maps add to a range what they and the frames around tell; worked out when first asked for: the problem must not be
    /// changed afterwards.
    pub fn under(&self, config: &FitConfig) -> &Self {
        let cleared = self.cleared(config).map_or(self, |cleared| cleared);
        cleared.offset(config).map_or(cleared, |offset| offset)
    }

    /// As [`Self::under`].
    pub(super) fn shared_under(self: Arc<Self>, config: &FitConfig) -> Arc<Self> {
        let cleared = self.cleared(config).map(Arc::clone).unwrap_or(self);
        cleared.offset(config).map(Arc::clone).unwrap_or(cleared)
    }

    fn cleared(&self, config: &FitConfig) -> Option<&Arc<Self>> {
        if config.sidelobes != Sidelobes::Removed || self.cleared {
            return None;
        }
        self.derived.cleared.get_or_init(|| self.without_sidelobes().map(Arc::new)).as_ref()
    }

    /// `None` where no map has any.
    fn without_sidelobes(&self) -> Option<Self> {
        let polar: Vec<Option<Polar>> = self.views.iter().map(Polar::of).collect();
        let of = |map: &dyn Fn(usize) -> Vec<f64>| -> (bool, Vec<Vec<f64>>) {
            let each = polar.iter().zip(&*self.views).enumerate().map(|(k, (polar, view))| {
                let map = map(k);
                let left = polar.as_ref().and_then(|polar| polar.without_sidelobes(view.quantity, &map));
                (left.is_some(), left.unwrap_or(map))
            });
            let (found, maps): (Vec<bool>, Vec<Vec<f64>>) = each.unzip();
            (found.contains(&true), maps)
        };
        let (found, maps) = of(&|k| self.maps[k].clone());
        if !found {
            return None;
        }
        // What is taken away of the maps changes nothing of the radars.
        self.measured_offsets();
        let around =
            self.neighbours.iter().map(|around| Neighbour::new(around.offset_s, of(&|k| around.map(k).to_vec()).1));
        let patched =
            self.patched.as_ref().map(|patched| patched.without_sidelobes().map_or(Arc::clone(patched), Arc::new));
        Some(Self { maps, neighbours: around.collect(), cleared: true, patched, ..self.clone() })
    }

    /// The views as fits with this configuration see them.
    pub fn views_under(&self, config: &FitConfig) -> &ViewSet {
        &self.under(config).views
    }

    fn offset(&self, config: &FitConfig) -> Option<&Arc<Self>> {
        if config.range_offset != RangeOffset::Measured
            || self.views.iter().any(|view| view.psf.measured_offset_m != 0.0)
        {
            return None;
        }
        self.derived.calibrated.get_or_init(|| self.with_offsets().map(Arc::new)).as_ref()
    }

    fn with_offsets(&self) -> Option<Self> {
        let views = self.views.with_range_offsets(self.measured_offsets()?);
        let calibrated = |patched: &Arc<Self>| Arc::new(Self { views: views.clone(), ..(**patched).clone() });
        let patched = self.patched.as_ref().map(calibrated);
        Some(Self { views, patched, ..self.clone() })
    }

    fn measured_offsets(&self) -> Option<&[f64]> {
        let measure = || {
            let mut around: Vec<&Neighbour> = self.neighbours.iter().collect();
            around.sort_by(|a, b| a.offset_s.abs().total_cmp(&b.offset_s.abs()));
            let own = self.maps.iter().map(Vec::as_slice).collect();
            let around = around.into_iter().take(FRAMES_COMPARED - 1).map(Neighbour::slices);
            range_offsets(&self.views, std::iter::once(own).chain(around))
        };
        self.derived.offsets.get_or_init(measure).as_deref()
    }

    /// With the range offsets that `other` measures, which has other maps of the same radars.
    #[must_use]
    pub fn calibrated_as(self, other: &Self) -> Self {
        other.measured_offsets();
        Self { derived: other.derived.clone(), ..self }
    }

    /// Adds the maps of a frame shortly before or after: (seconds after this frame, one map a view). The start reads
    /// velocity and heading from them, and the temporal term its place.
    ///
    /// # Errors
    /// As [`Self::new`] for a map that does not fit or has no finite cell.
    pub fn add_neighbour(&mut self, offset_s: f64, maps: &[&[f64]]) -> Result<(), FitError> {
        if maps.len() != self.views.len() {
            return Err(FitError::WrongParameters { what: "maps", got: maps.len(), expected: self.views.len() });
        }
        let (maps, _) = fill(&self.views, maps)?;
        self.neighbours.push(Neighbour::new(offset_s, maps));
        self.derived = Derived::default();
        self.neighbours.sort_by(|a, b| a.offset_s.total_cmp(&b.offset_s));
        Ok(())
    }

    /// The problem as if these cells had not been measured, neither in its frame nor in those around it: they take no part in L_EM,
    /// and no percentile or level of H_ori is theirs. `erased` has a mark a cell of each view, C order. What looks for places in the
    /// maps, as anchors do, finds what borders on the cells in their place.
    ///
    /// # Errors
    /// Where `erased` has other sizes than the maps, or nothing of a map is left.
    pub fn without(&self, erased: &[Vec<bool>]) -> Result<Self, FitError> {
        let holed = |maps: &dyn Fn(usize) -> Vec<f64>| -> Result<Vec<Vec<f64>>, FitError> {
            let of_view = |(k, view): (usize, &View)| {
                let (mut map, array) = (maps(k), view.array.clone());
                let marks = erased.get(k).map_or(&[][..], Vec::as_slice);
                if marks.len() != map.len() {
                    return Err(FitError::WrongShape { array, got: marks.len(), expected: map.len() });
                }
                map.iter_mut().zip(marks).filter(|(_, erased)| **erased).for_each(|(x, _)| *x = f64::NAN);
                if map.iter().all(|x| x.is_nan()) { Err(FitError::NoFiniteCell { array }) } else { Ok(map) }
            };
            self.views.iter().enumerate().map(of_view).collect()
        };
        if erased.iter().flatten().all(|erased| !erased) {
            return Ok(self.clone());
        }
        // What is taken away of the maps changes nothing of the radars.
        self.measured_offsets();
        let maps = holed(&|k| self.maps[k].clone())?;
        let slices = |maps: &[Vec<f64>]| -> Result<(Vec<Vec<f64>>, Vec<usize>), FitError> {
            fill(&self.views, &maps.iter().map(Vec::as_slice).collect::<Vec<_>>())
        };
        let mut patched = Self { maps: slices(&maps)?.0, patched: None, ..self.clone() };
        patched.neighbours.clear();
        let mut left = Self { maps, patched: None, ..self.clone() };
        left.neighbours.clear();
        for neighbour in &self.neighbours {
            let maps = holed(&|k| neighbour.map(k).to_vec())?;
            patched.neighbours.push(Neighbour::new(neighbour.offset_s, slices(&maps)?.0));
            left.neighbours.push(Neighbour::new(neighbour.offset_s, maps));
        }
        left.patched = Some(Arc::new(patched));
        Ok(left)
    }

    /// What the maps show to who reads them like this, worked out when first asked for; views must not be changed
    /// afterwards.
    pub(super) fn context(&self, reading: impl Into<Reading>) -> &TemporalContext {
        let reading = reading.into();
        if let Some(patched) = &self.patched {
            return patched.context(reading);
        }
        self.derived.contexts.of(&self.views, &self.maps, self.neighbours_in(reading.frames), reading)
    }

    /// What is left of its maps, worked out when first asked for; views must not be changed afterwards.
    pub(super) fn reduced(&self, reductions: Vec<Reduction>) -> Arc<ReducedMaps> {
        self.derived.reduced.of(self, reductions)
    }

    /// Where the frames around say that the mean of each person's joints is, world frame, m; empty without frames around.
    pub(super) fn anchors(&self, config: &FitConfig, params: &Pppr) -> Vec<Vec3> {
        if self.neighbours_in(config.frames_around).is_empty() {
            return Vec::new();
        }
        anchors(self.context(config), (&self.radar, &self.skeleton), config, params)
    }

    /// Those of [`Self::neighbours`] that a start may look at.
    pub fn neighbours_in(&self, frames: FramesAround) -> &[Neighbour] {
        let past = self.neighbours.partition_point(|neighbour| neighbour.offset_s < 0.0);
        match frames {
            FramesAround::Both => &self.neighbours,
            FramesAround::Past => &self.neighbours[..past],
            FramesAround::None => &[],
        }
    }

    /// The frames shortly before and after, in the order of time.
    pub fn neighbours(&self) -> &[Neighbour] {
        &self.neighbours
    }

    /// H_ori of a view, missing cells filled, erased ones NaN, C order; empty where there is no such view.
    pub fn map(&self, view: usize) -> &[f64] {
        self.maps.get(view).map_or(&[], Vec::as_slice)
    }

    /// What is measured in this frame, for these settings.
    pub(super) fn measured(&self, config: &FitConfig) -> Measured<'_> {
        let maps = self.maps.iter().map(Vec::as_slice).collect();
        let levels = config.objective != EmLoss::Iou;
        let by_range = config.clutter == Clutter::Modelled && levels;
        Measured {
            views: &self.views,
            skeleton: &self.skeleton,
            radar: &self.radar,
            maps,
            background: None,
            grids: self.views.grids().filter(|_| by_range).map(AsRef::as_ref).collect(),
            noises: (0..self.views.len())
                .filter(|_| levels)
                .map(|view| self.derived.reduced.noise(self, view))
                .collect(),
        }
    }

    /// How many cells of a view's map were filled.
    pub fn filled_cells(&self, view: usize) -> usize {
        self.filled.get(view).copied().unwrap_or(0)
    }

    /// Checks the sizes of `params` against the skeleton and the radar.
    ///
    /// # Errors
    /// Names the first size that differs.
    pub fn check(&self, params: &Pppr) -> Result<(), FitError> {
        let shape = params.shape();
        let sizes = [
            ("joints", shape.joints, self.skeleton.joints.len()),
            ("doppler_features", shape.doppler_features, self.radar.doppler_features),
        ];
        for (what, got, expected) in sizes {
            if got != expected {
                return Err(FitError::WrongParameters { what, got, expected });
            }
        }
        if shape.persons == 0 {
            return Err(FitError::WrongParameters { what: "persons", got: 0, expected: 1 });
        }
        Ok(())
    }
}

/// Checks the sizes of `maps` and fills their missing cells; also how many were filled in each.
fn fill(views: &[View], maps: &[&[f64]]) -> Result<(Vec<Vec<f64>>, Vec<usize>), FitError> {
    let (mut filled_maps, mut filled) = (Vec::with_capacity(maps.len()), Vec::with_capacity(maps.len()));
    for (view, map) in views.iter().zip(maps) {
        let array = view.array.clone();
        if map.len() != view.cells() {
            return Err(FitError::WrongShape { array, got: map.len(), expected: view.cells() });
        }
        let mut map = map.to_vec();
        filled.push(fill_missing(&mut map, &view.shape()).ok_or(FitError::NoFiniteCell { array })?);
        filled_maps.push(map);
    }
    Ok((filled_maps, filled))
}

fn check_skeleton(skeleton: &Skeleton) -> Result<(), FitError> {
    let joints = skeleton.joints.len();
    let indices = skeleton.bones.iter().flatten().chain(skeleton.angles.iter().flatten());
    if let Some(&index) = indices.max().filter(|&&index| index >= joints) {
        return Err(FitError::WrongParameters {
            what: "a joint index",
            got: index,
            expected: joints.saturating_sub(1),
        });
    }
    let (got, expected) = (skeleton.bone_lengths_m.len(), skeleton.bones.len());
    if got != expected {
        return Err(FitError::WrongParameters { what: "bone lengths", got, expected });
    }
    Ok(())
}

fn check_view(view: &View) -> Result<(), FitError> {
    let wrong = |reason: String| Err(FitError::WrongView { array: view.array.clone(), reason });
    if !(1..=3).contains(&view.axes.len()) {
        return wrong(format!("{} axes; expected 1 to 3", view.axes.len()));
    }
    for axis in &view.axes {
        if axis.bins == 0 || !axis.step().is_finite() || axis.step() == 0.0 {
            return wrong(format!("axis {} has no extent; expected bins ≥ 1 and lo ≠ hi", axis.kind.name()));
        }
    }
    let Some(region) = &view.region else { return Ok(()) };
    if region.len() != view.axes.len() {
        return wrong(format!("region has {} axes; expected {}", region.len(), view.axes.len()));
    }
    for (&[lo, hi], axis) in region.iter().zip(&view.axes) {
        if lo >= hi || hi > axis.bins {
            return wrong(format!(
                "region [{lo}, {hi}) of axis {}; expected within [0, {})",
                axis.kind.name(),
                axis.bins
            ));
        }
    }
    Ok(())
}
