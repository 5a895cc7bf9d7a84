//! How things are shown: kept over frame changes and restarts, never touched by a fit.

use super::compared::ComparedNumber;
use super::labels::LabelMode;
use super::queue::{SavedView, Sort};
use super::settings::{Live, LiveFrom, RunSpeed};
use crate::explore::ExploreSettings;
use crate::labels::Tag;
use serde::{Deserialize, Serialize};

/// Light, dark, or whatever the desktop says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum ThemeChoice {
    /// Dark.
    #[default]
    Dark,
    /// Light.
    Light,
    /// The desktop's choice.
    System,
}

/// Linear values or decibels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum MapScale {
    /// 20 log₁₀ of an amplitude, 10 log₁₀ of a power, relative to the map's maximum.
    #[default]
    Decibel,
    /// The stored value, divided by the map's maximum.
    Linear,
}

/// How the limits of the colour bar are found.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ColorRange {
    /// Percentiles of H_ori inside the map, shared by H_sim and kept over the steps of a run.
    Percentile {
        /// Lower percentile, 0..100.
        lo: f64,
        /// Upper percentile, 0..100.
        hi: f64,
    },
    /// Limits set by hand, in shown units.
    Fixed {
        /// Lower limit.
        lo: f64,
        /// Upper limit.
        hi: f64,
    },
}

impl Default for ColorRange {
    fn default() -> Self {
        Self::Percentile { lo: 2.0, hi: 99.8 }
    }
}

/// The colour limits of one map that were set by hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapLimits {
    /// Key of the map's array.
    pub array: String,
    /// The scale that the limits are in; on the other one they count for nothing.
    pub scale: MapScale,
    /// Lower limit, shown units.
    pub lo: f64,
    /// Upper limit, shown units.
    pub hi: f64,
    /// They stay when another frame is shown.
    pub locked: bool,
}

/// What the H_sim pane shows against H_ori.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Compare {
    /// H_sim alone; hold Shift for H_ori.
    #[default]
    Flip,
    /// H_ori left of a line that can be dragged, H_sim right of it.
    Wipe,
    /// H_sim − H_ori, both relative to their maxima, diverging colours about zero.
    Difference,
}

/// What H_sim is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Against {
    /// The measured map.
    #[default]
    Ori,
    /// H_sim of the baseline among the pinned fits.
    Baseline,
}

/// How the Gaussians are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum SplatMode {
    /// Alpha-blended splats.
    #[default]
    Splat,
    /// Opaque ellipsoids.
    Ellipsoid,
}

/// What the strip over the frames shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum TimelineStrip {
    /// Easy, medium, hard.
    #[default]
    Stratum,
    /// Mean IoU of each fit.
    Iou,
    /// Tags.
    Tags,
    /// How far the predictions of others are from the fits.
    Disagreement,
    /// How far they are from the truth, the farthest of each frame.
    PredictionError,
}

/// What the curves over the iterations show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum CurvesShown {
    /// Each curve with a scale of its own.
    #[default]
    Each,
    /// The total and its unweighted terms.
    Loss,
    /// IoU and errors.
    Quality,
}

/// Whose returns H_sim is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Isolate {
    /// All joints'.
    #[default]
    All,
    /// All but the selected joint's.
    Without,
    /// The selected joint's alone.
    Only,
}

impl Isolate {
    /// The next one, round.
    pub fn next(self) -> Self {
        match self {
            Self::All => Self::Without,
            Self::Without => Self::Only,
            Self::Only => Self::All,
        }
    }
}

/// How much curves over the iterations are smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Smoothing {
    /// As they are.
    #[default]
    Off,
    /// Over a few iterations.
    Light,
    /// Over tens of iterations.
    Strong,
}

impl Smoothing {
    /// All of them, least to most.
    pub const ALL: [Self; 3] = [Self::Off, Self::Light, Self::Strong];

    /// What of the mean so far is kept at each iteration; `None` where nothing is smoothed.
    pub fn weight(self) -> Option<f64> {
        match self {
            Self::Off => None,
            Self::Light => Some(0.8),
            Self::Strong => Some(0.95),
        }
    }

    /// In words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Off => "raw",
            Self::Light => "smooth 0.8",
            Self::Strong => "smooth 0.95",
        }
    }
}

/// Which two axes of a map with three are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum CubeAxes {
    /// Depth, and the first of the others.
    #[default]
    First,
    /// Depth, and the second of the others.
    Second,
    /// The two others.
    Others,
}

/// How the axis that is not drawn is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum ThirdAxis {
    /// The largest value along it.
    #[default]
    Largest,
    /// The mean along it.
    Mean,
    /// One of its bins.
    Bin(usize),
}

/// Which axes of a map are drawn, and in which coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct CubeView {
    /// What is drawn of three axes.
    pub axes: CubeAxes,
    /// What is not.
    pub third: ThirdAxis,
    /// Maps of range and angle are drawn on metres.
    pub birds_eye: bool,
    /// Maps in metres are drawn on range and angle.
    pub polar: bool,
}

/// Everything about the view that a person sets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ViewState {
    /// Light or dark.
    pub theme: ThemeChoice,
    /// Linear or dB.
    pub scale: MapScale,
    /// Limits of the colour bars that have none of their own.
    pub range: ColorRange,
    /// Limits of single maps.
    pub limits: Vec<MapLimits>,
    /// H_sim uses H_ori's limits.
    pub shared_range: bool,
    /// Name of the colour map, in lower case.
    pub colormap: String,
    /// What the H_sim pane shows.
    pub compare: Compare,
    /// What flip, wipe and difference compare H_sim with.
    pub against: Against,
    /// Whose returns the H_sim pane shows.
    pub isolate: Isolate,
    /// Where the wipe's line is, 0..1 of the map's width.
    pub wipe: f32,
    /// Which axes of the maps are drawn, and in which coordinates.
    pub cube: CubeView,
    /// Draw maps whose axes are metres to scale.
    pub true_proportions: bool,
    /// Maps and camera go with the person from frame to frame.
    pub follow: bool,
    /// Draw the EM region on the maps.
    pub show_region: bool,
    /// Draw the joints and bones on the maps.
    pub show_skeleton: bool,
    /// Draw labelled boxes on the maps.
    pub show_boxes: bool,
    /// Tell the cells round the cursor too.
    pub neighbours: bool,
    /// Hatch cells outside the colour range.
    pub show_clipped: bool,
    /// Opacity of the mask overlay over H_ori.
    pub mask_opacity: f32,
    /// Splats or ellipsoids.
    pub splat_mode: SplatMode,
    /// Gaussians are drawn up to this many standard deviations.
    pub splat_sigma: f32,
    /// Draw velocity arrows.
    pub show_velocity: bool,
    /// Bones keep their length where a joint is moved by hand.
    pub keep_bones: bool,
    /// Show the handles that move and turn a whole person.
    pub move_body: bool,
    /// Draw the truth skeleton.
    pub show_truth: bool,
    /// Draw the ground grid.
    pub show_grid: bool,
    /// Draw the radar's field of view.
    pub show_frustum: bool,
    /// Draw the start pose.
    pub show_initial: bool,
    /// Draw the negative gradients as arrows at the joints.
    pub show_gradients: bool,
    /// Log₁₀ of the losses.
    pub log_loss: bool,
    /// Log₁₀ of the iterations, from 1 on.
    pub log_iterations: bool,
    /// What the curves show.
    pub curves: CurvesShown,
    /// How much curves are smoothed.
    pub smoothing: Smoothing,
    /// Curves switched off, by name.
    pub hidden_curves: Vec<String>,
    /// Order of the frame list.
    pub sort: Sort,
    /// Columns of the frame list that are not shown, by their keys.
    pub hidden_columns: Vec<String>,
    /// Columns of the frame list that are shown on request, terms of the loss for example, by their keys.
    pub shown_terms: Vec<String>,
    /// By which number results A and B are compared.
    pub compared: ComparedNumber,
    /// Kept filters.
    pub saved_views: Vec<SavedView>,
    /// What the strip over the frames shows.
    pub strip: TimelineStrip,
    /// What labelling is for.
    pub label_mode: LabelMode,
    /// In agreement mode, the machine's evidence is hidden until the frame is tagged.
    pub blind: bool,
    /// Failure modes whose findings are unfolded.
    pub open_cards: Vec<Tag>,
    /// Print units, τ, iteration, seed and version under every picture.
    pub figure: bool,
    /// Draw the baseline's skeleton.
    pub show_baseline: bool,
    /// Draw the basins of the restart cloud.
    pub show_basins: bool,
    /// Scale of the whole interface.
    pub zoom: f32,
    /// Draw the outlines of the masks at τ and its neighbours on the maps.
    pub show_outlines: bool,
    /// Draw the points that are kept at τ in 3-D.
    pub show_clouds: bool,
    /// Begin to fit a frame as soon as it is shown.
    pub run_on_open: bool,
    /// Whether a change of settings fits anew at once.
    pub live: Live,
    /// Where such a fit begins.
    pub live_from: LiveFrom,
    /// How fast runs and replays are watched.
    pub speed: RunSpeed,
    /// What is explored.
    pub explore: ExploreSettings,
}

impl Default for ViewState {
    fn default() -> Self {
        Self {
            theme: ThemeChoice::default(),
            scale: MapScale::default(),
            range: ColorRange::default(),
            limits: Vec::new(),
            shared_range: true,
            colormap: "viridis".into(),
            compare: Compare::default(),
            against: Against::default(),
            isolate: Isolate::default(),
            wipe: 0.5,
            cube: CubeView::default(),
            true_proportions: false,
            follow: true,
            show_region: true,
            show_skeleton: true,
            show_boxes: true,
            neighbours: false,
            show_clipped: false,
            mask_opacity: 0.65,
            splat_mode: SplatMode::default(),
            splat_sigma: 2.0,
            show_velocity: true,
            keep_bones: true,
            move_body: false,
            show_truth: true,
            show_grid: true,
            show_frustum: true,
            show_initial: false,
            show_gradients: false,
            log_loss: true,
            log_iterations: false,
            curves: CurvesShown::default(),
            smoothing: Smoothing::default(),
            hidden_curves: Vec::new(),
            sort: Sort::default(),
            hidden_columns: ["hardness", "peaks", "static", "saliency", "converged", "reason", "by"]
                .map(str::to_owned)
                .to_vec(),
            shown_terms: Vec::new(),
            compared: ComparedNumber::default(),
            saved_views: Vec::new(),
            strip: TimelineStrip::default(),
            label_mode: LabelMode::default(),
            blind: true,
            open_cards: Vec::new(),
            figure: false,
            show_baseline: true,
            show_basins: true,
            zoom: 1.0,
            show_outlines: false,
            show_clouds: false,
            run_on_open: false,
            live: Live::default(),
            live_from: LiveFrom::default(),
            speed: RunSpeed::default(),
            explore: ExploreSettings::default(),
        }
    }
}

impl ViewState {
    /// With sizes and shares that can be drawn, whatever a file says.
    pub(super) fn in_range(mut self) -> Self {
        self.zoom = self.zoom.clamp(0.7, 2.0);
        self.wipe = self.wipe.clamp(0.0, 1.0);
        self.mask_opacity = self.mask_opacity.clamp(0.0, 1.0);
        self.splat_sigma = self.splat_sigma.clamp(0.5, 4.0);
        self.limits.retain(|limits| limits.lo.is_finite() && limits.hi.is_finite() && limits.lo < limits.hi);
        self
    }

    /// The limits of a map that were set by hand in the scale shown.
    pub fn limits_of(&self, array: &str) -> Option<&MapLimits> {
        self.limits.iter().find(|limits| limits.array == array && limits.scale == self.scale)
    }

    /// How the limits of a map are found.
    pub fn range_of(&self, array: &str) -> ColorRange {
        self.limits_of(array).map_or(self.range, |limits| ColorRange::Fixed { lo: limits.lo, hi: limits.hi })
    }

    /// Sets the limits of a map in the scale shown. Changing the frame resets nothing that a person set: they are locked,
    /// unless the lock was taken from them.
    pub fn set_limits(&mut self, array: &str, (lo, hi): (f64, f64)) {
        let locked = self.limits_of(array).is_none_or(|limits| limits.locked);
        self.free_limits(array);
        self.limits.push(MapLimits { array: array.to_owned(), scale: self.scale, lo, hi, locked });
    }

    /// Lets the limits of a map stay over frames, those on screen where it has none of its own; or no longer.
    pub fn lock_limits(&mut self, array: &str, on_screen: (f64, f64), locked: bool) {
        if self.limits_of(array).is_none() {
            self.set_limits(array, on_screen);
        }
        let scale = self.scale;
        for limits in self.limits.iter_mut().filter(|limits| limits.array == array && limits.scale == scale) {
            limits.locked = locked;
        }
    }

    /// The limits of a map are found again.
    pub fn free_limits(&mut self, array: &str) {
        let scale = self.scale;
        self.limits.retain(|limits| limits.array != array || limits.scale != scale);
    }

    /// The limits of every map are found again, by percentiles.
    pub fn auto_contrast(&mut self) {
        self.range = ColorRange::default();
        self.limits.clear();
    }

    /// Another frame is shown.
    pub(super) fn leave_frame(&mut self) {
        self.limits.retain(|limits| limits.locked);
    }
}
