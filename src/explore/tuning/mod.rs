//! Tuning map: what a fit comes to under every combination of the values of one or two settings, coarse to fine.
//!
//! The fits are those of `study sweep`, made by the same code from the same starts: cell by cell the same numbers, and
//! [`TuningMap::rows`] are the rows of its run folder.

mod axis;
mod quantity;

pub use axis::{AxisValues, TuningAxis};
pub use quantity::TunedQuantity;

use super::cores::{Hand, IdleCores, each};
use super::task::Showing;
use super::{Halt, coarse};
use crate::config::{Field, FitConfig, Value};
use crate::dataset::Dataset;
use crate::mhp::{ErasedCells, Precision};
use crate::study::run::{FrameSweep, GridAxis, RunRow, SweptFit, Variant, failed_row, sweep};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, OnceLock};

/// Of no more frames than this the maps stay in memory between the levels of a map.
const KEPT_FRAMES: usize = 8;

/// What a map is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TunedFrames {
    /// The frame on screen.
    #[default]
    Shown,
    /// The frames that are selected in the list.
    Selected,
    /// All that match its filter.
    Listed,
}

impl TunedFrames {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Shown, Self::Selected, Self::Listed];

    /// In words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Shown => "this frame",
            Self::Selected => "selected frames",
            Self::Listed => "listed frames",
        }
    }
}

/// What a person chose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct TuningSettings {
    /// One or two settings; the first goes across, the second up. None: those that are tuned most.
    pub axes: Vec<TuningAxis>,
    /// Of which frames.
    pub frames: TunedFrames,
    /// What is drawn.
    pub quantity: TunedQuantity,
    /// A small picture a frame instead of their mean.
    pub by_frame: bool,
}

impl Default for TuningSettings {
    fn default() -> Self {
        // L does not compare between weights, which are tuned most.
        Self { axes: Vec::new(), frames: TunedFrames::Shown, quantity: TunedQuantity::Iou, by_frame: false }
    }
}

impl TuningSettings {
    /// The axes as chosen, or around what is set where nobody chose.
    pub fn axes_around(&self, config: &FitConfig) -> Vec<TuningAxis> {
        if !self.axes.is_empty() {
            return self.axes.clone();
        }
        let fields = ["w_em", "tau_pct"].into_iter().filter_map(Field::of_key);
        fields.map(|field| TuningAxis::around(field, config)).collect()
    }
}

/// What is asked for.
#[derive(Debug, Clone)]
pub struct TuningRequest {
    /// Whose frames.
    pub dataset: Arc<Dataset>,
    /// Which.
    pub frames: Arc<[u32]>,
    /// What the settings of a cell build on.
    pub base: FitConfig,
    /// Scalar of the per-cell kernel.
    pub precision: Precision,
    /// One or two axes, the first across.
    pub grid: Vec<GridAxis>,
    /// Cells that no fit sees.
    pub erased: Arc<[ErasedCells]>,
}

impl TuningRequest {
    /// Whether another one asks for the same fits.
    pub fn is_same(&self, other: &Self) -> bool {
        let of = |r: &Self| (r.dataset.id(), r.base, r.precision);
        of(self) == of(other) && (&self.grid, &self.frames, &self.erased) == (&other.grid, &other.frames, &other.erased)
    }
}

/// The fits of a grid, as far as they are done.
#[derive(Debug, Clone, PartialEq)]
pub struct TuningMap {
    /// The axes; the last one is the fastest in [`Self::fit`]'s points, as in a sweep.
    pub grid: Vec<GridAxis>,
    /// The frames.
    pub frames: Arc<[u32]>,
    /// The settings that the cells build on.
    pub base: FitConfig,
    /// Cells that no fit saw.
    pub erased: Arc<[ErasedCells]>,
    /// The settings of each point.
    pub variants: Arc<[Variant]>,
    /// A fit a point and frame: point · frames + place of the frame.
    fits: Vec<Option<Arc<SweptFit>>>,
    /// Every so many points along each axis are done, of all frames.
    pub stride: usize,
}

impl TuningMap {
    /// Points of the grid.
    pub fn points(&self) -> usize {
        self.variants.len()
    }

    /// The fit of a point and a frame, by its place in [`Self::frames`].
    pub fn fit(&self, point: usize, frame: usize) -> Option<&SweptFit> {
        if frame >= self.frames.len() {
            return None;
        }
        self.fits.get(point * self.frames.len() + frame)?.as_deref()
    }

    /// The fits of a point, of those frames that are done.
    pub fn fits_of(&self, point: usize) -> impl Iterator<Item = &SweptFit> {
        (0..self.frames.len()).filter_map(move |frame| self.fit(point, frame))
    }

    /// A quantity of a point: its mean over the frames, and the standard deviation where there are several; `None` where it
    /// is not known of any.
    pub fn value(&self, point: usize, quantity: TunedQuantity) -> Option<(f64, f64)> {
        let values: Vec<f64> = self.fits_of(point).filter_map(|fit| quantity.of(fit)).collect();
        let n = values.len() as f64;
        if values.is_empty() {
            return None;
        }
        let mean = values.iter().sum::<f64>() / n;
        let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        Some((mean, if values.len() > 1 { (squares / (n - 1.0)).sqrt() } else { 0.0 }))
    }

    /// Values along each axis.
    pub fn shape(&self) -> Vec<usize> {
        self.grid.iter().map(|axis| axis.values.len()).collect()
    }

    /// The point at these places along the axes.
    pub fn point(&self, at: &[usize]) -> usize {
        at.iter().zip(self.shape()).fold(0, |point, (&k, n)| point * n + k.min(n.saturating_sub(1)))
    }

    /// The places of a point along the axes.
    pub fn places(&self, mut point: usize) -> Vec<usize> {
        let mut places: Vec<usize> =
            self.shape().iter().rev().map(|&n| (point % n.max(1), point /= n.max(1)).0).collect();
        places.reverse();
        places
    }

    /// Where a configuration lies along an axis, in steps from its first value; between two of them where it is a number
    /// between theirs. `None` where it lies outside.
    pub fn place_of(&self, axis: usize, config: &FitConfig) -> Option<f64> {
        let axis = self.grid.get(axis)?;
        let field = Field::of_key(&axis.key)?;
        let set = field.get(config);
        let text = field.text(set);
        if let Some(at) = axis.values.iter().position(|value| *value == text) {
            return Some(at as f64);
        }
        let Value::Number(x) = set else { return None };
        let values: Vec<f64> = axis.values.iter().map(|value| value.parse().ok()).collect::<Option<_>>()?;
        let between = |pair: &[f64]| (pair[0].min(pair[1])..=pair[0].max(pair[1])).contains(&x);
        let at = values.windows(2).position(between)?;
        Some(at as f64 + (x - values[at]) / (values[at + 1] - values[at]))
    }

    /// The point at which a quantity is best, of those that are known.
    pub fn best(&self, quantity: TunedQuantity) -> Option<usize> {
        let known = (0..self.points()).filter_map(|point| Some((point, self.value(point, quantity)?.0)));
        let sign = if quantity.less_is_better() { 1.0 } else { -1.0 };
        known.min_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1))).map(|(point, _)| point)
    }

    /// Whether every cell is done.
    pub fn is_complete(&self) -> bool {
        self.fits.iter().all(Option::is_some)
    }

    /// Cells that are done, and all.
    pub fn done(&self) -> (usize, usize) {
        (self.fits.iter().flatten().count(), self.fits.len())
    }

    /// The rows of a run that are done: what a sweep of the same grid would write.
    pub fn rows(&self) -> Vec<RunRow> {
        self.fits.iter().flatten().map(|fit| fit.row.clone()).collect()
    }
}

/// One piece of work: a frame, with one point or, where the frame is read anew, all of a level.
struct Piece {
    frame: usize,
    points: Vec<usize>,
    stride: usize,
}

/// Fits every point of every frame, coarse to fine; shows the map as it fills.
///
/// # Errors
/// Where the grid makes no sense, or it was cancelled.
pub(super) fn explore(
    request: &TuningRequest,
    cores: &IdleCores,
    show: &Showing<'_, TuningMap>,
) -> Result<TuningMap, Halt> {
    let variants = sweep(&request.base, &request.grid).map_err(|error| Halt::Failed(error.to_string()))?;
    if request.frames.is_empty() {
        return Err(Halt::Failed("there is no frame to fit".into()));
    }
    let (dataset, frames) = (request.dataset.as_ref(), &request.frames);
    let shape: Vec<usize> = request.grid.iter().map(|axis| axis.values.len()).collect();
    let kept = frames.len() <= KEPT_FRAMES;
    let pieces = pieces(&shape, frames.len(), kept);
    let mut map = TuningMap {
        grid: request.grid.clone(),
        frames: Arc::clone(frames),
        base: request.base,
        erased: Arc::clone(&request.erased),
        fits: vec![None; variants.len() * frames.len()],
        variants: variants.into(),
        stride: usize::MAX,
    };
    let variants = Arc::clone(&map.variants);
    let sweeps: Vec<OnceLock<Result<FrameSweep<'_>, String>>> = frames.iter().map(|_| OnceLock::new()).collect();
    let fit = |piece: &Piece, hand: &Hand<'_>| -> Result<Vec<SweptFit>, Halt> {
        let index = frames[piece.frame] as usize;
        let mut own = None;
        let sweep = if kept {
            sweeps[piece.frame].get_or_init(|| FrameSweep::read(dataset, index, &request.erased))
        } else {
            own.insert(FrameSweep::read(dataset, index, &request.erased))
        };
        let fitted = piece.points.iter().map(|&point| match sweep {
            Ok(sweep) => {
                sweep.fit((point, &variants[point]), request.precision, &|| hand.go_on()).ok_or(Halt::Cancelled)
            }
            Err(why) => {
                Ok(SweptFit { row: failed_row(dataset, (point, index), why.clone()), start: None, settled_at: None })
            }
        });
        fitted.collect()
    };
    show.begin("fitting", map.fits.len());
    let mut left: Vec<(usize, usize)> = coarse::left_by_stride(&pieces, |piece| piece.stride);
    each(
        (cores, show.progress()),
        pieces.len(),
        || (),
        |(), k, hand| fit(&pieces[k], hand),
        |k, fits| {
            let piece = &pieces[k];
            show.advance(fits.len());
            for (&point, fit) in piece.points.iter().zip(fits) {
                map.fits[point * frames.len() + piece.frame] = Some(Arc::new(fit));
            }
            let ended = coarse::ended(&mut left, piece.stride);
            if let Some(stride) = ended {
                map.stride = stride;
            }
            // A level that is whole is worth a look by itself.
            show.maybe(ended.is_some(), || map.clone());
        },
    )?;
    Ok(map)
}

/// The pieces of a map, coarse to fine; those of one level frame by frame.
fn pieces(shape: &[usize], frames: usize, kept: bool) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (stride, points) in coarse::levels(shape) {
        for frame in 0..frames {
            if kept {
                pieces.extend(points.iter().map(|&point| Piece { frame, points: vec![point], stride }));
            } else {
                pieces.push(Piece { frame, points: points.clone(), stride });
            }
        }
    }
    pieces
}
