//! What lies on a map: axes, labelled boxes, the EM region, the skeleton and the cursor.

use super::MapExtent;
use super::picture::Content;
use crate::app::map_image::Orientation;
use crate::app::map_plane::Plane;
use crate::app::theme::{self, Tokens};
use crate::app::widgets::{round_step, tick};
use crate::body::Skeleton;
use crate::geometry::Vec3;
use crate::radar::{Axis, AxisKind, View};
use crate::session::Session;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Ui, pos2, vec2};

/// What a map shows, in its upper left corner: array, content, IoU.
pub(super) fn title(
    painter: &Painter,
    plot: Rect,
    view: &View,
    content: Content,
    reference: Content,
    session: &Session,
) {
    let text = match content {
        Content::Masks => {
            let iou = session.fit.shown.as_ref().and_then(|snapshot| {
                let index = session.data.dataset.as_ref()?.info().views.iter().position(|v| v.array == view.array)?;
                snapshot.masks.get(index)?.iou()
            });
            iou.map_or_else(|| "IoU —".to_owned(), |iou| format!("IoU {iou:.3}"))
        }
        _ if session.fit.shown.is_none() && content != Content::Ori => waiting(session),
        Content::Difference if reference == Content::Base => "H_sim − baseline".into(),
        Content::Difference => "H_sim − H_ori".into(),
        Content::Base => {
            let pin = session.pins.baseline();
            pin.map_or_else(String::new, |pin| format!("H_sim of {} ({})", pin.name, pin.frame_name))
        }
        Content::Isolated => {
            let skeleton = session.fit.problem.as_ref().map(|problem| &problem.skeleton);
            let joint = session.joint.zip(skeleton).map_or_else(String::new, |(joint, skeleton)| {
                skeleton.shown_name(joint % skeleton.joints.len().max(1))
            });
            format!("H_sim {} {joint}", super::isolated_word(session).unwrap_or("of"))
        }
        _ => content.name().to_owned(),
    };
    let room = (plot.width() - 8.0).max(20.0);
    let lettered = |array: &str| {
        let mut job = egui::text::LayoutJob::default();
        let format =
            |color| egui::TextFormat { font_id: FontId::proportional(theme::CAPTION), color, ..Default::default() };
        job.append(array, 0.0, format(theme::DARK.dim));
        job.append(&text, if array.is_empty() { 0.0 } else { 6.0 }, format(theme::DARK.text));
        job.wrap = egui::text::TextWrapping::truncate_at_width(room);
        painter.layout_job(job)
    };
    // Of a long name the end is left out, and all of it before anything of the content.
    let shortened = (1..view.array.len()).rev().filter_map(|end| view.array.get(..end)).map(|head| format!("{head}…"));
    let mut names = std::iter::once(view.array.clone()).chain(shortened).map(|name| lettered(&name));
    let galley = names.find(|galley| !galley.elided).unwrap_or_else(|| lettered(""));
    let ground = Rect::from_min_size(plot.min, galley.size() + vec2(8.0, 3.0));
    painter.rect_filled(ground, 0.0, theme::DARK.canvas.gamma_multiply(0.72));
    painter.galley(plot.min + vec2(4.0, 1.0), galley, theme::DARK.text);
}

/// Why there is no simulated map yet, or none at all.
fn waiting(session: &Session) -> String {
    match &session.fit.status {
        crate::session::FitStatus::Failed(why) => format!("no fit: {why}"),
        _ => "preparing…".into(),
    }
}

/// Ticks along the lower edge; in a row's first map the name inside it, and ticks and name along the left edge too.
pub(super) fn axes(ui: &Ui, plot: Rect, view: &View, o: Orientation, window: MapExtent, first: bool, tokens: &Tokens) {
    let painter = ui.painter();
    let stroke = Stroke::new(1.0, tokens.dim);
    let font = theme::mono(10.0);
    let caption = FontId::proportional(10.0);
    let [(across, from_left), (up, from_top)] = &o.shown_axes(view);
    for (t, text) in ticks(across, window.min[0], window.max[0], *from_left, plot.width() / 52.0) {
        let x = plot.min.x + t * plot.width();
        painter.vline(x, plot.max.y..=plot.max.y + 3.0, stroke);
        // Never over the edge: the next map's numbers begin there.
        let galley = painter.layout_no_wrap(text, font.clone(), tokens.dim);
        let half = 0.5 * galley.size().x;
        if x - half >= plot.min.x - 1.0 && x + half <= plot.max.x + 1.0 {
            painter.galley(pos2(x - half, plot.max.y + 3.0), galley, tokens.dim);
        }
    }
    if !first {
        return;
    }
    for (t, text) in ticks(up, window.min[1], window.max[1], *from_top, plot.height() / 34.0) {
        let y = plot.min.y + t * plot.height();
        painter.hline(plot.min.x - 3.0..=plot.min.x, y, stroke);
        painter.text(pos2(plot.min.x - 5.0, y), Align2::RIGHT_CENTER, text, font.clone(), tokens.dim);
    }
    let words =
        [axis_caption(across), format!("{} {}", across.shown_name(), across.shown_unit()), across.shown_unit().into()];
    let fits = |text: String| {
        let galley = painter.layout_no_wrap(text, caption.clone(), theme::DARK.dim);
        (galley.size().x + 8.0 <= plot.width()).then_some(galley)
    };
    if let Some(galley) = words.into_iter().find_map(fits) {
        let at = pos2(plot.center().x - 0.5 * galley.size().x, plot.max.y - galley.size().y - 2.0);
        let ground = Rect::from_min_size(at, galley.size()).expand2(vec2(4.0, 1.0));
        painter.rect_filled(ground, 0.0, theme::DARK.canvas.gamma_multiply(0.72));
        painter.galley(at, galley, theme::DARK.dim);
    }
    let name = format!("{} {} →", up.shown_name(), up.shown_unit());
    let galley = painter.layout_no_wrap(name, caption, tokens.dim);
    let at = pos2(plot.min.x - 40.0, plot.center().y + galley.size().x / 2.0);
    painter.add(egui::epaint::TextShape::new(at, galley, tokens.dim).with_angle(-std::f32::consts::FRAC_PI_2));
}

fn axis_caption(axis: &Axis) -> String {
    let unit = axis.shown_unit();
    match axis.kind {
        AxisKind::Y | AxisKind::Azimuth | AxisKind::Cone => format!("← left   {} {unit}   right →", axis.shown_name()),
        AxisKind::Z | AxisKind::Elevation => format!("down   {} {unit}   up →", axis.shown_name()),
        AxisKind::Doppler => format!("approaching   {unit}   receding →"),
        _ => format!("{} {unit}", axis.shown_name()),
    }
}

/// (position 0..1 in the window, text) of round values of an axis.
fn ticks(axis: &Axis, from: f32, to: f32, forward: bool, wanted: f32) -> Vec<(f32, String)> {
    let bins = axis.bins as f64;
    let at = |unit: f64| axis.shown_at((if forward { unit } else { 1.0 - unit }) * bins - 0.5);
    let (a, b) = (at(f64::from(from)), at(f64::from(to)));
    let (lo, hi) = (a.min(b), a.max(b));
    let span = hi - lo;
    if !(span.is_finite() && span > 0.0) {
        return Vec::new();
    }
    let step = round_step(span / f64::from(wanted.max(1.5)));
    let first = (lo / step).ceil() as i64;
    let last = (hi / step).floor() as i64;
    (first..=last.min(first.saturating_add(40)))
        .filter_map(|i| {
            let value = i as f64 * step;
            let native = if axis.kind.is_angular() { value.to_radians() } else { value };
            let xi = if axis.spacing == crate::radar::Spacing::Sine { native.sin() } else { native };
            let across = (axis.bin(xi) + 0.5) / bins;
            let unit = if forward { across } else { 1.0 - across };
            let t = (unit as f32 - from) / (to - from);
            (-0.001..=1.001).contains(&t).then(|| (t, tick(value, step * 10.0)))
        })
        .collect()
}

/// The corners of the EM region, a picture of its mask, in the grid of cells.
pub(super) fn region_box([width, height]: [usize; 2], mask: &[bool]) -> Option<[[f32; 2]; 2]> {
    let (mut min, mut max) = ([usize::MAX; 2], [0usize; 2]);
    for (row, cells) in mask.chunks_exact(width.max(1)).enumerate() {
        let (Some(first), Some(last)) = (cells.iter().position(|cell| *cell), cells.iter().rposition(|cell| *cell))
        else {
            continue;
        };
        min = [min[0].min(first), min[1].min(row)];
        max = [max[0].max(last + 1), max[1].max(row + 1)];
    }
    (max[0] > 0).then(|| {
        let unit = |p: [usize; 2]| [p[0] as f32 / width as f32, p[1] as f32 / height as f32];
        [unit(min), unit(max)]
    })
}

/// Region, boxes, skeletons.
pub(super) fn draw(
    painter: &Painter,
    session: &Session,
    view: &View,
    index: usize,
    region: Option<[[f32; 2]; 2]>,
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
) {
    let (look, o) = (&session.view, Orientation::of(view, session.view.cube));
    field_of_view(painter, view, o, to_screen);
    if look.show_region
        && let Some(region) = region
    {
        let stroke = Stroke::new(1.0, Color32::from_white_alpha(150));
        painter.extend(egui::Shape::dashed_line(&outline(view, o, region, to_screen), stroke, 5.0, 4.0));
    }
    if look.show_boxes
        && let Some(frame) = &session.data.frame
    {
        for b in frame.map_boxes.get(index).into_iter().flatten() {
            boxed(painter, view, o, *b, to_screen);
        }
    }
    if look.show_truth
        && let Some(truth) = session.data.frame.as_ref().and_then(|f| f.truth.as_ref())
        && let Some(dataset) = &session.data.dataset
    {
        let stroke = Stroke::new(1.0, theme::DARK.truth.gamma_multiply(0.85));
        let at = moving_on(&truth.joints, truth.velocities.as_deref(), view, o, to_screen);
        bones(painter, &dataset.info().skeleton, &at, &|_, _| stroke);
    }
    if look.show_truth
        && let (Some(frame), Some(dataset)) = (&session.data.frame, &session.data.dataset)
    {
        let skeleton = &dataset.info().skeleton;
        for source in session.sources.list().iter().filter(|source| source.shown) {
            let stroke = Stroke::new(1.5, theme::DARK.of_source(source));
            // Dark beneath: the brightest cells are as light as the lines.
            let beneath = Stroke::new(3.5, Color32::from_black_alpha(120));
            let joints = source.joints_on(frame.index, skeleton.joints.len());
            let mut at = moving_on(&joints, None, view, o, to_screen);
            for (at, p) in at.iter_mut().zip(&joints).filter(|(_, p)| !p[0].is_finite()) {
                *at = pos2(p[0] as f32, f32::NAN);
            }
            bones(painter, skeleton, &at, &|_, _| beneath);
            bones(painter, skeleton, &at, &|_, _| stroke);
        }
    }
    if look.show_skeleton
        && let Some(problem) = &session.fit.problem
    {
        let at = joints_on(session, view, o, to_screen);
        let skeleton = &problem.skeleton;
        let joints = skeleton.joints.len().max(1);
        // Dark-theme colours in both themes: the ground is the map. Of several people each has its own.
        let several = at.len() > joints;
        let color = |person: usize, side| {
            if several { theme::DARK.person(session.identity(person)) } else { theme::DARK.side(side) }
        };
        let stroke = |person: usize, side| Stroke::new(1.5, color(person, side));
        bones(painter, skeleton, &at, &stroke);
        for (joint, at) in at.into_iter().enumerate() {
            let selected = session.joint == Some(joint);
            let color = color(joint / joints, skeleton.side(joint % joints));
            painter.circle(
                at,
                if selected { 4.0 } else { 2.2 },
                color,
                Stroke::new(1.0, Color32::from_black_alpha(180)),
            );
            if selected {
                painter.circle_stroke(at, 7.0, Stroke::new(1.5, Color32::WHITE));
            }
        }
    }
}

/// Where the shown joints are on a map; on a Doppler axis at their own radial velocities.
pub(super) fn joints_on(
    session: &Session,
    view: &View,
    o: Orientation,
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
) -> Vec<Pos2> {
    let Some(shown) = &session.fit.shown else { return Vec::new() };
    moving_on(shown.params.positions(), Some(shown.params.velocities()), view, o, to_screen)
}

/// Where joints are on a map; on a Doppler axis at their own radial velocities, or at rest where none are known.
fn moving_on(
    joints: &[Vec3],
    velocities: Option<&[Vec3]>,
    view: &View,
    o: Orientation,
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
) -> Vec<Pos2> {
    let velocity = |k: usize| velocities.and_then(|all| all.get(k)).copied().unwrap_or_default();
    let at = |(k, &p): (usize, &Vec3)| to_screen(o.unit_from_bins(view, &view.bins_of_moving(p, velocity(k))));
    joints.iter().enumerate().map(at).collect()
}

fn bones(painter: &Painter, skeleton: &Skeleton, joints: &[Pos2], stroke: &dyn Fn(usize, crate::body::Side) -> Stroke) {
    for (number, person) in joints.chunks_exact(skeleton.joints.len().max(1)).enumerate() {
        for &bone in &skeleton.bones {
            let (Some(&a), Some(&b)) = (person.get(bone[0]), person.get(bone[1])) else { continue };
            if a.x.is_nan() || b.x.is_nan() {
                continue;
            }
            painter.line_segment([a, b], stroke(number, skeleton.bone_side(bone)));
        }
    }
}

fn boxed(painter: &Painter, view: &View, o: Orientation, b: [f64; 4], to_screen: &dyn Fn([f64; 2]) -> Pos2) {
    // Box edges are pixel edges: half a bin before the centre of their first pixel.
    let corner = |row: f64, column: f64| {
        let of = |axis: usize| [row, column].get(axis).map_or(0.0, |edge| edge - 0.5);
        o.grid_from_bins(view, [of(o.horizontal), of(o.vertical)])
    };
    let line = outline(view, o, grid_box(corner(b[0], b[1]), corner(b[2], b[3])), to_screen);
    let first = line.first().copied().unwrap_or_default();
    painter.line(line, Stroke::new(1.5, theme::DARK.truth));
    let font = FontId::proportional(9.0);
    painter.text(first + vec2(1.0, -1.0), Align2::LEFT_BOTTOM, "label", font, Color32::WHITE);
}

/// The box between two places in the grid of cells.
pub(super) fn grid_box(a: [f64; 2], b: [f64; 2]) -> [[f32; 2]; 2] {
    [std::array::from_fn(|k| a[k].min(b[k]) as f32), std::array::from_fn(|k| a[k].max(b[k]) as f32)]
}

/// The closed outline on the screen of a box of the grid of cells, from its upper left corner.
pub(super) fn outline(
    view: &View,
    o: Orientation,
    grid: [[f32; 2]; 2],
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
) -> Vec<Pos2> {
    o.outline(view, grid).into_iter().map(to_screen).collect()
}

/// The edges of what the radar sees, and on metres rings of round ranges.
fn field_of_view(painter: &Painter, view: &View, o: Orientation, to_screen: &dyn Fn([f64; 2]) -> Pos2) {
    if o.plane == Plane::Cells {
        return;
    }
    let stroke = |alpha| Stroke::new(1.0, Color32::from_white_alpha(alpha));
    painter.line(outline(view, o, [[0.0; 2], [1.0; 2]], to_screen), stroke(110));
    if o.plane != Plane::BirdsEye {
        return;
    }
    let range = |y: f64| o.values_at(view, [0.5, y])[1];
    let (far, near) = (range(0.0), range(1.0));
    let step = round_step((far - near) / 6.0);
    for ring in (near / step).ceil() as i64..=(far / step).floor() as i64 {
        let at = ring as f64 * step;
        let y = (at - far) / (near - far);
        let arc: Vec<Pos2> = o.line(view, [0.0, y], [1.0, y]).into_iter().map(to_screen).collect();
        let end = arc.last().copied().unwrap_or_default();
        painter.line(arc, stroke(55));
        // Beyond the edge of what is seen, where no cell is.
        let text = format!("{} m", tick(at, step * 10.0));
        painter.text(end + vec2(4.0, 0.0), Align2::LEFT_TOP, text, FontId::proportional(9.0), theme::DARK.dim);
    }
}

/// The linked cursor: the outline of the cell and hair lines.
pub(super) fn crosshair(
    painter: &Painter,
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
    view: &View,
    o: Orientation,
    pixel: [usize; 2],
) {
    let size = o.size(view);
    let at = |by: f64| -> [f64; 2] { std::array::from_fn(|k| (pixel[k] as f64 + by) / size[k] as f64) };
    let hair = Stroke::new(1.0, Color32::from_white_alpha(70));
    // Along one range and along one angle, whatever the picture's coordinates are.
    let [x, y] = at(0.5);
    for (from, to) in [([0.0, y], [1.0, y]), ([x, 0.0], [x, 1.0])] {
        painter.line(o.line(view, from, to).into_iter().map(to_screen).collect(), hair);
    }
    painter.line(outline(view, o, grid_box(at(0.0), at(1.0)), to_screen), Stroke::new(1.5, Color32::WHITE));
}

/// The joint drawn within 10 points of the pointer.
pub(super) fn joint_near(
    session: &Session,
    view: &View,
    o: Orientation,
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
    pointer: Pos2,
) -> Option<usize> {
    let joints = joints_on(session, view, o, to_screen);
    let distances = joints.iter().map(|at| at.distance(pointer)).enumerate();
    let (joint, nearest) = distances.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (nearest < 10.0).then_some(joint)
}
