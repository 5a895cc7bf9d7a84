//! L_EM of one frame: what its views measure, the body as they see it, and the way back; SPEC sections 3, 4 and 8.

use super::cell_box::CellBox;
use super::em::{EmTarget, Left, Workspace};
use super::gaussian::{WorldGaussianBars, WorldGaussians};
use super::levels::Levels;
use super::percentile::percentile;
use super::region::Region;
use super::skin::{Skin, radar_place};
use super::splat::ViewModel;
use super::{Ious, Precision};
use crate::body::{Pppr, Skeleton};
use crate::config::{BodyModel, EmLoss, FitConfig, Summation};
use crate::radar::{AxisKind, RadarConfig, SpatialGrid, View};
use smallvec::SmallVec;

/// The median of powers of noise alone, of the percentile of them that is told as noise: speckle is exponential.
const MEDIAN_OF_NOISE: f64 = 1.94;

/// What is measured in a frame's EM regions, and the scratch of an evaluation.
pub(super) struct FrameEm {
    /// Each view's region with B_ori over its cells.
    targets: Vec<EmTarget>,
    workspaces: Vec<Workspace>,
    /// Scratch a Gaussian, and that one's adjoint.
    gaussians: WorldGaussians,
    bars: WorldGaussianBars,
    /// Where the body is one of skin.
    skin: Option<Skin>,
}

/// The maps of a frame with what is the same in all views: one map a view, C order, missing cells filled and erased ones NaN; a
/// background power a cell, where one is known.
pub(super) struct Measured<'a> {
    pub views: &'a [View],
    pub skeleton: &'a Skeleton,
    pub radar: &'a RadarConfig,
    pub maps: SmallVec<[&'a [f64]; 4]>,
    pub background: Option<&'a [Vec<f64>]>,
    /// The rings of each view, where clutter is modelled by range.
    pub grids: SmallVec<[&'a SpatialGrid; 4]>,
    /// The power of each view's noise, of the unit of the map's power; none where masks are compared.
    pub noises: SmallVec<[f64; 4]>,
}

impl Measured<'_> {
    /// What joins the noise in a view's region, whose cells these are: a power a cell, of the unit of the map's power, if anything
    /// does. Sidelobes of a body, walls and leakage are arcs about the radar: of each range it is the median of the cells
    /// beside the region, so far as it rises over the noise's, and at least what stands there over time.
    fn clutter(&self, view: usize, cells: &[usize], noise: f64) -> Option<Vec<f64>> {
        let standing = self.background.map(|maps| maps[view].as_slice());
        let Some(grid) = self.grids.get(view) else {
            return standing.map(|standing| cells.iter().map(|&cell| standing[cell]).collect());
        };
        let (map, quantity) = (self.maps[view], self.views[view].quantity);
        // Cells that were erased say nothing of what lies beside.
        let mut inside: Vec<bool> = map.iter().map(|h| h.is_nan()).collect();
        for &cell in cells {
            inside[cell] = true;
        }
        let beside = grid.beside(|cell| quantity.power(map[cell]), &inside);
        let speckle = MEDIAN_OF_NOISE * noise;
        let of_cell = |&cell: &usize| {
            let rises = (beside[cell] - speckle).max(0.0);
            standing.map_or(rises, |standing| rises.max(standing[cell]))
        };
        Some(cells.iter().map(of_cell).collect())
    }
}

/// The settings of the forward model: points of skin lie where their echo comes from.
pub(super) fn forward_config(config: &FitConfig, skin: bool) -> FitConfig {
    FitConfig { surface_offset_m: if skin { 0.0 } else { config.surface_offset_m }, ..*config }
}

/// The skin of a body before these views, if the settings ask for one and the skeleton has one.
pub(super) fn skin_of(
    config: &FitConfig,
    (views, skeleton, radar): (&[View], &Skeleton, &RadarConfig),
) -> Option<Skin> {
    // Along a Doppler axis every feature counts, elsewhere their mean.
    let spectral = views.iter().any(|view| view.axes.iter().any(|axis| axis.kind == AxisKind::Doppler));
    let features = if spectral { radar.doppler_features } else { 1 };
    (config.body == BodyModel::Skin).then(|| Skin::new(skeleton, radar_place(views), features)).flatten()
}

impl FrameEm {
    /// Of what is measured in `regions`, one a view.
    pub(super) fn new(measured: &Measured<'_>, regions: &[Region], config: &FitConfig, precision: Precision) -> Self {
        let skin = skin_of(config, (measured.views, measured.skeleton, measured.radar));
        Self::with_skin(measured, regions, (config, precision), skin)
    }

    /// The same with a skin that was made before.
    pub(super) fn with_skin(
        measured: &Measured<'_>,
        regions: &[Region],
        (config, precision): (&FitConfig, Precision),
        skin: Option<Skin>,
    ) -> Self {
        let of_view = |(k, region): (usize, &Region)| {
            let (view, map) = (&measured.views[k], measured.maps[k]);
            let indices = region.indices(&view.shape());
            let inside = |map: &[f64]| -> Vec<f64> { indices.iter().map(|&i| map[i]).collect() };
            let cells = inside(map);
            let there: Vec<bool> = cells.iter().map(|h| !h.is_nan()).collect();
            let erased = there.contains(&false);
            let threshold = if erased {
                let rest: Vec<f64> = cells.iter().copied().filter(|h| !h.is_nan()).collect();
                percentile(&rest, 100.0 - config.tau_pct)
            } else {
                percentile(&cells, 100.0 - config.tau_pct)
            };
            let ori: Vec<bool> = cells.iter().map(|&h| h > threshold).collect();
            let cell_box = CellBox::new(view, &region.bins, (&ori, erased.then_some(&there)), precision);
            let left = cell_box.there.as_ref().map(|marks| {
                let places = (0..marks.len()).filter(|&k| marks[k]).collect();
                Left { places, cells: there }
            });
            let levels = (config.objective != EmLoss::Iou).then(|| {
                let noise = measured.noises[k];
                let background = measured.clutter(k, &indices, noise);
                // Powers that add, without a spectrum along an axis.
                let spectral = view.axes.iter().any(|axis| axis.kind == AxisKind::Doppler);
                let in_rows = precision == Precision::F32 && config.summation == Summation::Incoherent && !spectral;
                let of = (cells.as_slice(), noise);
                Levels::new(
                    (config.objective, config.dynamic_range_db),
                    view.quantity,
                    &cell_box,
                    of,
                    background.as_deref(),
                    in_rows,
                )
            });
            EmTarget { ori, cell_box, levels, left }
        };
        Self {
            targets: regions.iter().enumerate().map(of_view).collect(),
            workspaces: regions.iter().map(|_| Workspace::default()).collect(),
            gaussians: WorldGaussians::default(),
            bars: WorldGaussianBars::default(),
            skin,
        }
    }

    /// Its skin of few points, where its body is one of skin.
    pub(super) fn coarse_skin(&self, skeleton: &Skeleton) -> Option<Skin> {
        self.skin.as_ref()?.coarse(skeleton)
    }

    /// Evaluates with another skin from now on, if there is one, and puts its own there.
    pub(super) fn change_skin(&mut self, other: &mut Option<Skin>) {
        if other.is_some() {
            std::mem::swap(&mut self.skin, other);
        }
    }

    /// What an evaluation at these persons costs at most: Gaussians times cells.
    pub(super) fn work(&self, params: &Pppr) -> f64 {
        let gaussians = self
            .skin
            .as_ref()
            .map_or(params.shape().total_joints(), |skin| params.shape().persons * skin.owners().count());
        let cells: usize = self.targets.iter().map(|target| target.cell_box.marked.len()).sum();
        gaussians as f64 * cells as f64
    }

    /// L_EM with nobody: what noise and clutter leave of the levels; 1 where masks are compared, or levels by their likelihood.
    pub(super) fn empty_loss(&self) -> f64 {
        let of_view = |target: &EmTarget| target.levels.as_ref().map_or(1.0, Levels::empty_loss);
        self.targets.iter().map(of_view).sum::<f64>() / self.targets.len().max(1) as f64
    }

    /// B_ori over a view's region, in C order.
    pub(super) fn ori(&self, view: usize) -> &[bool] {
        &self.targets[view].ori
    }

    /// Whether each cell of a view's region takes part, in C order; `None` where all do.
    pub(super) fn left(&self, view: usize) -> Option<&[bool]> {
        self.targets[view].left.as_ref().map(|left| left.cells.as_slice())
    }

    /// L_EM at `params`; adds its gradient to `gradient`, and tells the IoU of each view where asked.
    pub(super) fn evaluate(
        &mut self,
        (radar, config): (&RadarConfig, &FitConfig),
        precision: Precision,
        params: &Pppr,
        gradient: &mut Pppr,
        mut iou: Option<&mut Ious>,
    ) -> f64 {
        let Self { targets, workspaces, gaussians, bars, skin, .. } = self;
        let config = &forward_config(config, skin.is_some());
        if let Some(skin) = skin.as_mut() {
            skin.fill(params, precision);
        }
        let seen = skin.as_ref().map_or(params, |skin| &skin.points);
        gaussians.fill(seen, skin.is_some(), precision);
        bars.reset(gaussians.joints());
        let share = 1.0 / targets.len() as f64;
        // Stage by stage rather than view by view: each stage's instructions then stay at hand.
        let models: SmallVec<[ViewModel<'_>; 4]> =
            targets.iter().map(|target| ViewModel::new(radar, &target.cell_box.view, config)).collect();
        for (model, workspace) in models.iter().zip(&mut *workspaces) {
            workspace.project(model, (seen, &*gaussians), precision);
        }
        let mut em = 0.0;
        for ((model, target), workspace) in models.iter().zip(&*targets).zip(&mut *workspaces) {
            let answer = workspace.compare(model, target, (Some(share), iou.is_some()), precision);
            em += answer.loss * share;
            if let Some(iou) = iou.as_mut() {
                iou.push(answer.iou);
            }
        }
        let onto = skin.as_mut().map_or(&mut *gradient, |skin| &mut skin.gradient);
        for (model, workspace) in models.iter().zip(&mut *workspaces) {
            workspace.pull_back(model, gaussians, (&mut *onto, &mut *bars), precision);
        }
        gaussians.pull_back(bars, onto, precision);
        if let Some(skin) = skin.as_ref() {
            skin.pull_back(params, gradient);
        }
        em
    }

    /// L_EM alone, without its gradient.
    pub(super) fn loss(&self, of: (&RadarConfig, &FitConfig), precision: Precision, params: &Pppr) -> f64 {
        self.loss_in(of, precision, params, &mut EmScratch::default())
    }

    /// The same, in room that was taken before: from the second time on nothing is allocated for cells.
    pub(super) fn loss_in(
        &self,
        (radar, config): (&RadarConfig, &FitConfig),
        precision: Precision,
        params: &Pppr,
        EmScratch { workspace, gaussians, skin }: &mut EmScratch,
    ) -> f64 {
        if skin.is_none() {
            skin.clone_from(&self.skin);
        }
        let skin = skin.as_mut().filter(|_| self.skin.is_some()).map(|skin| {
            skin.fill(params, precision);
            &*skin
        });
        let seen = skin.map_or(params, |skin| &skin.points);
        let config = &forward_config(config, skin.is_some());
        gaussians.fill(seen, skin.is_some(), precision);
        let losses = self.targets.iter().map(|target| {
            let model = ViewModel::new(radar, &target.cell_box.view, config);
            workspace.project(&model, (seen, &*gaussians), precision);
            workspace.compare(&model, target, (None, false), precision).loss
        });
        losses.sum::<f64>() / self.targets.len() as f64
    }
}

/// Room for evaluations of L_EM without gradient, of fits of one problem with one set of settings.
#[derive(Default)]
pub struct EmScratch {
    workspace: Workspace,
    gaussians: WorldGaussians,
    skin: Option<Skin>,
}
