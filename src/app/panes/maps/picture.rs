//! Textures of the maps, made again only when what they show changed.

use super::overlay::region_box;
use crate::app::map_image::{Histogram, Orientation, Shown, colorize, floor, limits, shown};
use crate::app::panes::lit::contour;
use crate::app::panes::ribbon::NEIGHBOURS;
use crate::app::theme;
use crate::dataset::Frame;
use crate::mhp::percentile;
use crate::radar::View;
use crate::render::Colormap;
use crate::session::{Against, ColorRange, CubeView, MapLimits, MapScale, Session};
use crate::worker::Snapshot;
use egui::{Color32, ColorImage, Painter, Rect, TextureHandle, TextureOptions, Ui, vec2};
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;

/// What a map shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Content {
    Ori,
    Sim,
    /// H_sim of the baseline.
    Base,
    /// H_sim without the selected joint, or of it alone.
    Isolated,
    Difference,
    Masks,
}

impl Content {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Ori => "H_ori",
            Self::Sim => "H_sim",
            Self::Base => "H_sim of the baseline",
            Self::Isolated => "H_sim, isolated",
            Self::Difference => "Difference",
            Self::Masks => "Masks",
        }
    }
}

/// A map in H_sim's place, how it lies, how it is scaled, and as it is shown.
type Isolated = (Arc<Vec<f64>>, Orientation, (MapScale, ColorRange), Shown);

/// The maps of one view as shown.
#[derive(Default)]
struct ViewPictures {
    /// What the maps are of, and how they lie.
    of: Option<(View, Orientation)>,
    size: [usize; 2],
    ori_stored: Vec<f64>,
    ori: Option<Shown>,
    sim_stored: Vec<f64>,
    sim: Option<Shown>,
    base: Option<Shown>,
    /// What H_sim is made of instead of all joints, and how it is shown.
    isolated: Option<Isolated>,
    /// Outlines of the masks around τ, where they are asked for.
    outlines: Option<Outlines>,
    masks: Option<[Vec<bool>; 3]>,
    /// Corners of the EM region, in the grid of cells.
    region: Option<[[f32; 2]; 2]>,
    /// How the limits are found.
    range: ColorRange,
    ori_limits: (f64, f64),
    ori_histogram: Histogram,
    sim_limits: (f64, f64),
    difference_limit: f64,
}

/// Lines of H_ori's mask and of H_sim's, each at τ's lower neighbour, τ, and its upper one.
pub(super) type Outlines = [[Vec<[[f64; 2]; 2]>; 3]; 2];

/// Every view's pictures and the textures made of them.
#[derive(Default)]
pub(super) struct Pictures {
    views: Vec<ViewPictures>,
    frame: Option<Arc<Frame>>,
    snapshot: Option<Arc<Snapshot>>,
    baseline: Option<Arc<Snapshot>>,
    look: Option<Look>,
    /// With whether the texture shows what the maps are now.
    textures: RefCell<HashMap<(usize, Content), (TextureHandle, bool)>>,
}

/// What of the view state changes pixels.
#[derive(Debug, Clone, PartialEq)]
struct Look {
    scale: MapScale,
    range: ColorRange,
    limits: Vec<MapLimits>,
    shared_range: bool,
    colormap: Colormap,
    hatch: bool,
    mask_opacity: f32,
    against: Against,
    cube: CubeView,
    /// τ, where the masks are outlined, as its bits.
    outlined: Option<Tau>,
}

/// A τ that is compared with itself.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Tau(f64);

impl Look {
    fn of(session: &Session) -> Self {
        let view = &session.view;
        let colormap = Colormap::ALL.into_iter().find(|m| m.name().eq_ignore_ascii_case(&view.colormap));
        Self {
            scale: view.scale,
            range: view.range,
            limits: view.limits.clone(),
            shared_range: view.shared_range,
            colormap: colormap.unwrap_or_default(),
            hatch: view.show_clipped,
            mask_opacity: view.mask_opacity,
            against: view.against,
            cube: view.cube,
            outlined: view.show_outlines.then_some(Tau(session.config.tau_pct)),
        }
    }
}

fn same<T>(a: Option<&Arc<T>>, b: Option<&Arc<T>>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (None, None) => true,
        _ => false,
    }
}

impl Pictures {
    /// Brings everything up to date with the session; does nothing where nothing changed.
    pub(super) fn update(&mut self, session: &Session, views: &[View], frame: &Arc<Frame>) {
        let look = Look::of(session);
        let new_frame = !same(self.frame.as_ref(), Some(frame));
        let new_snapshot = !same(self.snapshot.as_ref(), session.fit.shown.as_ref());
        let new_look = self.look.as_ref() != Some(&look);
        let baseline = session.pins.baseline().and_then(|pin| pin.snapshot.clone());
        let new_baseline = !same(self.baseline.as_ref(), baseline.as_ref());
        if !(new_frame || new_snapshot || new_look || new_baseline) {
            return;
        }
        let all = new_frame || new_look;
        self.views.resize_with(views.len(), ViewPictures::default);
        for (i, view) in views.iter().enumerate() {
            let pictures = &mut self.views[i];
            let orientation = Orientation::of(view, look.cube);
            pictures.size = orientation.size(view);
            if all {
                pictures.of = Some((view.clone(), orientation));
            }
            pictures.range = session.view.range_of(&view.array);
            let range = pictures.range;
            if all && let Some(map) = frame.maps.get(i) {
                pictures.ori_stored = orientation.picture(view, &map.data);
                let ori = shown(&pictures.ori_stored, look.scale, range, view.quantity.db_factor());
                pictures.ori_limits = limits(&ori.values, range);
                pictures.ori_histogram = Histogram::of(&ori.values, pictures.ori_limits);
                pictures.ori = Some(ori);
            }
            if all || new_baseline {
                let map = baseline.as_ref().and_then(|base| base.h_sim.get(i)).filter(|map| map.len() == view.cells());
                let shown =
                    |map: &[f64]| shown(&orientation.picture(view, map), look.scale, range, view.quantity.db_factor());
                pictures.base = map.map(|map| shown(map));
            }
            if all || new_snapshot {
                pictures.take_snapshot(session.fit.shown.as_deref(), i, view, &look);
            }
        }
        let outlined = look.outlined.filter(|_| all || new_snapshot);
        for pictures in &mut self.views {
            match (look.outlined, outlined) {
                (None, _) => pictures.outlines = None,
                (_, Some(tau)) => pictures.outlines = pictures.outlined(tau.0),
                _ => {}
            }
        }
        for ((_, content), (_, fresh)) in self.textures.get_mut() {
            *fresh &= !all && *content == Content::Ori;
        }
        self.frame = Some(Arc::clone(frame));
        self.snapshot.clone_from(&session.fit.shown);
        self.baseline = baseline;
        self.look = Some(look);
    }

    /// The outlines of the masks of a view around τ.
    pub(super) fn outlines(&self, view: usize) -> Option<&Outlines> {
        self.views.get(view)?.outlines.as_ref()
    }

    /// Takes in a map that is shown in H_sim's place, or none.
    pub(super) fn isolate(
        &mut self,
        view: usize,
        (of, o): (&View, Orientation),
        map: Option<Arc<Vec<f64>>>,
        look: (MapScale, ColorRange),
    ) {
        let Some(pictures) = self.views.get_mut(view) else { return };
        let known = pictures.isolated.as_ref();
        let same = match (known, &map) {
            (Some((known, orientation, how, _)), Some(map)) => {
                Arc::ptr_eq(known, map) && *orientation == o && *how == look
            }
            (None, Some(_)) => false,
            // Until the next one is there the last one stays.
            (_, None) => true,
        };
        if same {
            return;
        }
        pictures.isolated = map.map(|map| {
            let shown = shown(&o.picture(of, &map), look.0, look.1, of.quantity.db_factor());
            (map, o, look, shown)
        });
        if let Some((_, fresh)) = self.textures.get_mut().get_mut(&(view, Content::Isolated)) {
            *fresh = false;
        }
    }

    /// Draws the part `uv` of a map into `rect`.
    pub(super) fn paint(&self, ui: &Ui, painter: &Painter, rect: Rect, uv: Rect, view: usize, content: Content) {
        let mut textures = self.textures.borrow_mut();
        if !matches!(textures.get(&(view, content)), Some((_, true))) {
            let Some(image) = self.image(view, content) else { return };
            if let Some((texture, fresh)) = textures.get_mut(&(view, content)) {
                texture.set(image, TextureOptions::NEAREST);
                *fresh = true;
            } else {
                let name = format!("map {view} {}", content.name());
                let texture = ui.ctx().load_texture(name, image, TextureOptions::NEAREST);
                textures.insert((view, content), (texture, true));
            }
        }
        let of = self.views.get(view).and_then(|pictures| pictures.of.as_ref());
        if let (Some((texture, _)), Some((view, o))) = (textures.get(&(view, content)), of) {
            let to_screen =
                |p: [f64; 2]| rect.min + (vec2(p[0] as f32, p[1] as f32) - uv.min.to_vec2()) * rect.size() / uv.size();
            painter.add(o.mesh(view, texture.id(), painter.clip_rect(), &to_screen));
        }
    }

    fn image(&self, view: usize, content: Content) -> Option<ColorImage> {
        let (pictures, look) = (self.views.get(view)?, self.look.as_ref()?);
        let paint =
            |values: &[f64], limits, map| colorize(pictures.size, values, limits, map, look.hatch, theme::NAN_CELL);
        Some(match content {
            Content::Ori => paint(&pictures.ori.as_ref()?.values, pictures.ori_limits, look.colormap),
            Content::Sim => paint(&pictures.sim.as_ref()?.values, pictures.sim_limits, look.colormap),
            Content::Difference => {
                let limit = pictures.difference_limit;
                paint(&pictures.difference(self.reference())?, (-limit, limit), Colormap::Diverging)
            }
            Content::Base => paint(&pictures.base.as_ref()?.values, pictures.sim_limits, look.colormap),
            Content::Isolated => paint(&pictures.isolated.as_ref()?.3.values, pictures.sim_limits, look.colormap),
            Content::Masks => pictures.mask_image(look.mask_opacity)?,
        })
    }

    /// What H_sim is compared with: the baseline's H_sim where that was chosen and is there, else H_ori.
    pub(super) fn reference(&self) -> Content {
        let chosen = self.look.as_ref().is_some_and(|look| look.against == Against::Baseline);
        if chosen && self.baseline.is_some() { Content::Base } else { Content::Ori }
    }

    pub(super) fn colormap(&self, content: Content) -> Colormap {
        match content {
            Content::Difference => Colormap::Diverging,
            _ => self.look.as_ref().map(|look| look.colormap).unwrap_or_default(),
        }
    }

    pub(super) fn limits(&self, view: usize, content: Content) -> (f64, f64) {
        let Some(pictures) = self.views.get(view) else { return (0.0, 1.0) };
        match content {
            Content::Sim | Content::Base | Content::Isolated => pictures.sim_limits,
            Content::Difference => (-pictures.difference_limit, pictures.difference_limit),
            _ => pictures.ori_limits,
        }
    }

    pub(super) fn unit(&self, content: Content) -> &'static str {
        let decibel = self.look.as_ref().is_none_or(|look| look.scale == MapScale::Decibel);
        match (content, decibel) {
            (Content::Difference, true) => "Δ dB",
            (Content::Difference, false) => "Δ of max",
            (_, true) => "dB re max",
            (_, false) => "of max",
        }
    }

    /// What lies lower than this is shown as this.
    pub(super) fn floor(&self, view: usize, content: Content) -> f64 {
        let (look, view) = (self.look.as_ref().filter(|_| content != Content::Difference), self.views.get(view));
        look.zip(view).map_or(f64::NEG_INFINITY, |(look, view)| floor(look.scale, view.range))
    }

    /// How often what is shown occurs.
    pub(super) fn histogram(&self, view: usize, content: Content) -> Histogram {
        let limits = self.limits(view, content);
        let Some(pictures) = self.views.get(view) else { return Histogram::of(&[], limits) };
        let of = |shown: &Option<Shown>| shown.as_ref().map_or_else(Vec::new, |shown| shown.values.clone());
        match content {
            Content::Ori | Content::Masks => pictures.ori_histogram.clone(),
            Content::Sim => Histogram::of(&of(&pictures.sim), limits),
            Content::Base => Histogram::of(&of(&pictures.base), limits),
            Content::Isolated => {
                let values = pictures.isolated.as_ref().map_or_else(Vec::new, |(.., shown)| shown.values.clone());
                Histogram::of(&values, limits)
            }
            Content::Difference => {
                let mut values = pictures.difference(self.reference()).unwrap_or_default();
                for value in &mut values {
                    *value = value.clamp(limits.0, limits.1);
                }
                Histogram::of(&values, limits)
            }
        }
    }

    /// (stored, shown) value of H_ori and of H_sim at a pixel.
    pub(super) fn values(&self, view: usize, pixel: [usize; 2]) -> [Option<(f64, f64)>; 2] {
        let Some(p) = self.views.get(view) else { return [None, None] };
        let at = pixel[1] * p.size[0] + pixel[0];
        let pair = |stored: &[f64], shown: &Option<Shown>| Some((*stored.get(at)?, *shown.as_ref()?.values.get(at)?));
        [pair(&p.ori_stored, &p.ori), pair(&p.sim_stored, &p.sim)]
    }

    /// Shown values of the nine cells round a pixel, of H_ori and of H_sim, row by row; `None` beyond the map.
    pub(super) fn around(&self, view: usize, [column, row]: [usize; 2]) -> [Option<[[Option<f64>; 3]; 3]>; 2] {
        let Some(p) = self.views.get(view) else { return [None, None] };
        let cell = |shown: &Shown, dx: usize, dy: usize| {
            let (x, y) = ((column + dx).checked_sub(1)?, (row + dy).checked_sub(1)?);
            (x < p.size[0] && y < p.size[1]).then(|| shown.values.get(y * p.size[0] + x).copied())?
        };
        let nine = |shown: &Shown| std::array::from_fn(|dy| std::array::from_fn(|dx| cell(shown, dx, dy)));
        [p.ori.as_ref().map(nine), p.sim.as_ref().map(nine)]
    }

    /// The percentile of a stored value among the cells of H_ori (0) or H_sim (1).
    pub(super) fn rank(&self, view: usize, map: usize, stored: f64) -> Option<f64> {
        let p = self.views.get(view)?;
        let cells = if map == 0 { &p.ori_stored } else { &p.sim_stored };
        let known = cells.iter().filter(|x| x.is_finite());
        let (below, all) = known.fold((0usize, 0usize), |(below, all), &x| (below + usize::from(x < stored), all + 1));
        (all > 0).then(|| 100.0 * below as f64 / all as f64)
    }

    /// Corners of the EM region in the grid of cells.
    pub(super) fn region(&self, view: usize) -> Option<[[f32; 2]; 2]> {
        self.views.get(view)?.region
    }

    /// Whether a pixel is in H_ori's mask, in H_sim's, in the EM region.
    pub(super) fn mask_at(&self, view: usize, pixel: [usize; 2]) -> Option<[bool; 3]> {
        let p = self.views.get(view)?;
        let masks = p.masks.as_ref()?;
        let at = pixel[1] * p.size[0] + pixel[0];
        Some([*masks[0].get(at)?, *masks[1].get(at)?, *masks[2].get(at)?])
    }
}

impl ViewPictures {
    fn take_snapshot(&mut self, snapshot: Option<&Snapshot>, index: usize, view: &View, look: &Look) {
        let orientation = Orientation::of(view, look.cube);
        self.sim = None;
        (self.masks, self.region) = (None, None);
        self.sim_stored.clear();
        let Some(snapshot) = snapshot else { return };
        if let Some(map) = snapshot.h_sim.get(index) {
            self.sim_stored = orientation.picture(view, map);
            let sim = shown(&self.sim_stored, look.scale, self.range, view.quantity.db_factor());
            let shared = look.shared_range || matches!(self.range, ColorRange::Fixed { .. });
            self.sim_limits = if shared { self.ori_limits } else { limits(&sim.values, self.range) };
            self.sim = Some(sim);
            self.difference_limit = match look.scale {
                MapScale::Decibel => 0.5 * (self.ori_limits.1 - self.ori_limits.0).abs().max(1.0),
                MapScale::Linear => 1.0,
            };
        }
        self.masks = snapshot
            .masks
            .get(index)
            .map(|masks| [&masks.ori, &masks.sim, &masks.inside].map(|mask| orientation.mask_picture(view, mask)));
        self.region = self.masks.as_ref().and_then(|[.., inside]| region_box(orientation.size(view), inside));
    }

    /// Outlines of both masks at τ and its neighbours, inside the EM region.
    fn outlined(&self, tau: f64) -> Option<Outlines> {
        let inside = &self.masks.as_ref()?[2];
        let of = |map: &[f64]| {
            let within: Vec<f64> = map.iter().zip(inside).filter(|(_, i)| **i).map(|(x, _)| *x).collect();
            let shown: Vec<f64> = map.iter().zip(inside).map(|(x, i)| if *i { *x } else { 0.0 }).collect();
            NEIGHBOURS.map(|by| {
                let level = percentile(&within, 100.0 - (by * tau).clamp(0.1, 100.0));
                // A mask of zeros has no outline.
                if level > 0.0 { contour(self.size, &shown, level) } else { Vec::new() }
            })
        };
        Some([of(&self.ori_stored), of(&self.sim_stored)])
    }

    /// H_sim less what it is compared with, both clipped to the lower limit, so that what is nothing does not hide the rest.
    fn difference(&self, reference: Content) -> Option<Vec<f64>> {
        let (ori, sim) =
            (if reference == Content::Base { &self.base } else { &self.ori }.as_ref()?, self.sim.as_ref()?);
        let floor = self.ori_limits.0;
        Some(sim.values.iter().zip(&ori.values).map(|(s, o)| s.max(floor) - o.max(floor)).collect())
    }

    /// White both, orange H_ori only, blue H_sim only, over a dim grey H_ori; outside the EM region darker.
    fn mask_image(&self, opacity: f32) -> Option<ColorImage> {
        let masks = self.masks.as_ref()?;
        let ori = self.ori.as_ref()?;
        let mut image = colorize(self.size, &ori.values, self.ori_limits, Colormap::Grey, false, theme::NAN_CELL);
        let colors = MaskColors::new(opacity);
        for (i, pixel) in image.pixels.iter_mut().enumerate() {
            *pixel = colors.of(*pixel, masks[0][i], masks[1][i], masks[2][i]);
        }
        Some(image)
    }
}

/// The colour of a cell by its grey and the three masks, worked out once a picture.
struct MaskColors(Vec<Color32>);

impl MaskColors {
    fn new(opacity: f32) -> Self {
        let mix = |a: Color32, b: Color32, t: f32| {
            let channel = |x: u8, y: u8| (f32::from(x) + (f32::from(y) - f32::from(x)) * t).round() as u8;
            Color32::from_rgb(channel(a.r(), b.r()), channel(a.g(), b.g()), channel(a.b(), b.b()))
        };
        let of = |grey: Color32, masks: usize| {
            let ground = mix(theme::MASK_GROUND, grey, if masks & 4 != 0 { 0.45 } else { 0.18 });
            match masks & 3 {
                3 => mix(ground, theme::MASK_BOTH, opacity.max(0.05)),
                1 => mix(ground, theme::MASK_ORI, opacity),
                2 => mix(ground, theme::MASK_SIM, opacity),
                _ => ground,
            }
        };
        let greys = (0..=255u8).map(Color32::from_gray).chain([theme::NAN_CELL]);
        Self(greys.flat_map(|grey| (0..8).map(move |masks| of(grey, masks))).collect())
    }

    fn of(&self, pixel: Color32, in_ori: bool, in_sim: bool, inside: bool) -> Color32 {
        let grey = if pixel == theme::NAN_CELL { 256 } else { usize::from(pixel.r()) };
        self.0[8 * grey + usize::from(in_ori) + 2 * usize::from(in_sim) + 4 * usize::from(inside)]
    }
}
