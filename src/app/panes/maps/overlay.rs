//! What lies on a map: axes, labelled boxes, the EM region, the skeleton, the cursor and the probe's text.

use super::MapExtent;
use super::picture::{Content, Pictures};
use crate::app::map_image::{Orientation, level};
use crate::app::theme::{self, Tokens};
use crate::app::widgets::tick;
use crate::body::Skeleton;
use crate::geometry::Vec3;
use crate::radar::{Axis, AxisKind, View};
use crate::session::Session;
use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Ui, pos2, vec2};

#[expect(clippy::too_many_arguments, reason = "where it is drawn, and what the title tells")]
/// Title line of a map: array, what it shows, IoU.
pub(super) fn title(
    ui: &Ui,
    rect: Rect,
    plot: Rect,
    view: &View,
    content: Content,
    reference: Content,
    tokens: &Tokens,
    session: &Session,
) {
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    let at = pos2(plot.min.x.min(rect.max.x - 120.0), rect.min.y + 3.0);
    let caption = FontId::proportional(theme::CAPTION);
    let name = painter.text(at, Align2::LEFT_TOP, &view.array, caption.clone(), tokens.text);
    let text = match content {
        Content::Masks => {
            let iou = session.fit.shown.as_ref().and_then(|snapshot| {
                let index = session.data.dataset.as_ref()?.info().views.iter().position(|v| v.array == view.array)?;
                snapshot.masks.get(index)?.iou()
            });
            iou.map_or_else(|| "IoU —".to_owned(), |iou| format!("IoU {iou:.3}"))
        }
        _ if session.fit.shown.is_none() && content != Content::Ori => "preparing…".into(),
        Content::Difference if reference == Content::Base => "H_sim − baseline".into(),
        Content::Difference => "H_sim − H_ori".into(),
        Content::Base => {
            let pin = session.pins.baseline();
            pin.map_or_else(String::new, |pin| format!("H_sim of {} ({})", pin.name, pin.frame_name))
        }
        _ => content.name().to_owned(),
    };
    let font = if content == Content::Masks { theme::mono(theme::CAPTION) } else { caption };
    painter.text(name.right_top() + vec2(8.0, 0.0), Align2::LEFT_TOP, text, font, tokens.dim);
}

/// Ticks and names along the left and the lower edge.
pub(super) fn axes(ui: &Ui, plot: Rect, view: &View, o: Orientation, window: MapExtent, tokens: &Tokens) {
    let painter = ui.painter();
    let stroke = Stroke::new(1.0, tokens.dim);
    let font = theme::mono(10.0);
    let caption = FontId::proportional(10.0);
    let across = &view.axes[o.horizontal];
    for (t, text) in ticks(across, window.min[0], window.max[0], o.horizontal_from_left, plot.width() / 52.0) {
        let x = plot.min.x + t * plot.width();
        painter.vline(x, plot.max.y..=plot.max.y + 3.0, stroke);
        painter.text(pos2(x, plot.max.y + 3.0), Align2::CENTER_TOP, text, font.clone(), tokens.dim);
    }
    let up = &view.axes[o.vertical];
    for (t, text) in ticks(up, window.min[1], window.max[1], o.vertical_from_top, plot.height() / 34.0) {
        let y = plot.min.y + t * plot.height();
        painter.hline(plot.min.x - 3.0..=plot.min.x, y, stroke);
        painter.text(pos2(plot.min.x - 5.0, y), Align2::RIGHT_CENTER, text, font.clone(), tokens.dim);
    }
    let name = axis_caption(across);
    painter.text(pos2(plot.center().x, plot.max.y + 14.0), Align2::CENTER_TOP, name, caption.clone(), tokens.dim);
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
    let raw = span / f64::from(wanted.max(1.5));
    let magnitude = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * magnitude).into_iter().find(|s| *s >= raw).unwrap_or(raw);
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

/// The EM region's corners in picture coordinates.
pub(super) fn region_box(view: &View, inside: &[bool]) -> Option<[[f32; 2]; 2]> {
    let o = Orientation::of(view);
    let [width, height] = o.size(view);
    let mask = o.mask_picture(view, inside);
    let (mut min, mut max) = ([usize::MAX; 2], [0usize; 2]);
    for row in 0..height {
        for column in 0..width {
            if mask[row * width + column] {
                min = [min[0].min(column), min[1].min(row)];
                max = [max[0].max(column + 1), max[1].max(row + 1)];
            }
        }
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
    o: Orientation,
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
    tokens: &Tokens,
) {
    let look = &session.view;
    if look.show_region
        && let Some(masks) = session.fit.shown.as_ref().and_then(|s| s.masks.get(index))
        && let Some([min, max]) = region_box(view, &masks.inside)
    {
        let corner = |p: [f32; 2]| to_screen([f64::from(p[0]), f64::from(p[1])]);
        dashed(painter, Rect::from_two_pos(corner(min), corner(max)), Color32::from_white_alpha(150));
    }
    if look.show_boxes
        && let Some(frame) = &session.data.frame
    {
        for b in frame.map_boxes.get(index).into_iter().flatten() {
            boxed(painter, view, o, *b, to_screen, tokens);
        }
    }
    if look.show_truth
        && let Some(truth) = session.data.frame.as_ref().and_then(|f| f.truth.as_ref())
        && let Some(dataset) = &session.data.dataset
    {
        let color = Color32::from_white_alpha(170);
        bones(painter, &dataset.info().skeleton, &truth.joints, view, o, to_screen, &|_, _| Stroke::new(1.0, color));
    }
    if look.show_skeleton
        && let Some(problem) = &session.fit.problem
    {
        let positions = session.shown_positions();
        let skeleton = &problem.skeleton;
        let joints = skeleton.joints.len().max(1);
        // Dark-theme colours in both themes: the ground is the map. Of several people each has its own.
        let several = positions.len() > joints;
        let color = |person: usize, side| {
            if several { theme::DARK.person(session.identity(person)) } else { theme::DARK.side(side) }
        };
        let stroke = |person: usize, side| Stroke::new(1.5, color(person, side));
        bones(painter, skeleton, positions, view, o, to_screen, &stroke);
        for (joint, &p) in positions.iter().enumerate() {
            let at = to_screen(o.unit_from_bins(view, &view.bins_of(p)));
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

fn bones(
    painter: &Painter,
    skeleton: &Skeleton,
    positions: &[Vec3],
    view: &View,
    o: Orientation,
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
    stroke: &dyn Fn(usize, crate::body::Side) -> Stroke,
) {
    let joints = skeleton.joints.len().max(1);
    for (number, person) in positions.chunks_exact(joints).enumerate() {
        for &bone in &skeleton.bones {
            let (Some(&a), Some(&b)) = (person.get(bone[0]), person.get(bone[1])) else { continue };
            let ends = [a, b].map(|p| to_screen(o.unit_from_bins(view, &view.bins_of(p))));
            painter.line_segment(ends, stroke(number, skeleton.bone_side(bone)));
        }
    }
}

fn boxed(
    painter: &Painter,
    view: &View,
    o: Orientation,
    b: [f64; 4],
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
    _: &Tokens,
) {
    // Box edges are pixel edges: half a bin before the centre of their first pixel.
    let corner = |row: f64, column: f64| {
        let mut bins = vec![0.0; view.axes.len()];
        bins[0] = row - 0.5;
        if let Some(second) = bins.get_mut(1) {
            *second = column - 0.5;
        }
        to_screen(o.unit_from_bins(view, &bins))
    };
    let rect = Rect::from_two_pos(corner(b[0], b[1]), corner(b[2], b[3]));
    painter.rect_stroke(rect, 0.0, Stroke::new(1.5, Color32::from_rgb(0xF2, 0x65, 0x5C)), egui::StrokeKind::Middle);
    painter.text(
        rect.left_top() + vec2(1.0, -1.0),
        Align2::LEFT_BOTTOM,
        "label",
        FontId::proportional(9.0),
        Color32::WHITE,
    );
}

fn dashed(painter: &Painter, rect: Rect, color: Color32) {
    let corners = [rect.left_top(), rect.right_top(), rect.right_bottom(), rect.left_bottom(), rect.left_top()];
    painter.extend(egui::Shape::dashed_line(&corners, Stroke::new(1.0, color), 5.0, 4.0));
}

/// The pixel at picture coordinates.
pub(super) fn pixel_at(view: &View, o: Orientation, unit: [f64; 2]) -> Option<[usize; 2]> {
    let [width, height] = o.size(view);
    let (x, y) = ((unit[0] * width as f64).floor(), (unit[1] * height as f64).floor());
    (x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64).then_some([x as usize, y as usize])
}

/// The linked cursor: the outline of the cell and hair lines.
pub(super) fn crosshair(
    painter: &Painter,
    plot: Rect,
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
    view: &View,
    o: Orientation,
    pixel: [usize; 2],
    _tokens: &Tokens,
) {
    let [width, height] = o.size(view);
    let corner = |x: usize, y: usize| to_screen([x as f64 / width as f64, y as f64 / height as f64]);
    let cell = Rect::from_two_pos(corner(pixel[0], pixel[1]), corner(pixel[0] + 1, pixel[1] + 1));
    let hair = Stroke::new(1.0, Color32::from_white_alpha(70));
    painter.vline(cell.center().x, plot.y_range(), hair);
    painter.hline(plot.x_range(), cell.center().y, hair);
    painter.rect_stroke(cell.expand(1.0), 0.0, Stroke::new(1.0, Color32::WHITE), egui::StrokeKind::Outside);
}

/// What the probe says of a pixel: stored and shown values, where it is.
pub(super) fn probe(
    session: &Session,
    pictures: &Pictures,
    view: &View,
    index: usize,
    o: Orientation,
    pixel: [usize; 2],
) -> String {
    let [width, height] = o.size(view);
    let unit = [(pixel[0] as f64 + 0.5) / width as f64, (pixel[1] as f64 + 0.5) / height as f64];
    let [across, up] = o.bins_from_unit(view, unit);
    let unit_text = pictures.unit(Content::Ori);
    let mut lines = vec![format!(
        "{}[{}, {}]",
        view.array,
        if o.vertical == 0 { up.round() } else { across.round() },
        if o.vertical == 0 { across.round() } else { up.round() },
    )];
    for (name, value) in ["H_ori", "H_sim"].iter().zip(pictures.values(index, pixel)) {
        lines.push(match value {
            Some((stored, _)) if stored.is_nan() => format!("{name}  NaN (filled before the fit)"),
            Some((stored, shown)) => {
                let shown = level(shown, pictures.floor(Content::Ori));
                format!("{name}  {stored:>11.4e}  {shown:>8} {unit_text}")
            }
            None => format!("{name}  —"),
        });
    }
    if session.view.compare == crate::session::Compare::Difference
        && let [Some((_, ori)), Some((_, sim))] = pictures.values(index, pixel)
    {
        let floor = pictures.limits(index, Content::Ori).0;
        let difference = sim.max(floor) - ori.max(floor);
        lines.push(format!("Δ      {difference:>20.2} {} (from {floor:.0} up)", pictures.unit(Content::Difference)));
    }
    if let Some([ori, sim, inside]) = pictures.mask_at(index, pixel) {
        let mask = match (ori, sim) {
            (true, true) => "in both masks",
            (true, false) => "in H_ori's mask only",
            (false, true) => "in H_sim's mask only",
            (false, false) => "in no mask",
        };
        lines.push(if inside { mask.to_owned() } else { "outside the EM region".into() });
    }
    for axis in [o.vertical, o.horizontal] {
        let a = &view.axes[axis];
        let bin = if axis == o.vertical { up } else { across };
        lines.push(format!("{:<15} {:>8.3} {}", a.shown_name(), a.shown_at(bin), a.shown_unit()));
    }
    lines.extend(polar(view, o, up, across));
    if o.collapsed.is_some() {
        lines.push("largest over the third axis".into());
    }
    if session.view.compare == crate::session::Compare::Flip {
        lines.push("hold Shift: flip H_ori and H_sim".into());
    }
    lines.join("\n")
}

/// Range and angle of a cell of a Cartesian map, in the map's own plane.
fn polar(view: &View, o: Orientation, up: f64, across: f64) -> Vec<String> {
    let (v, h) = (&view.axes[o.vertical], &view.axes[o.horizontal]);
    let depth = matches!(v.kind, AxisKind::X | AxisKind::DepthH | AxisKind::DepthV);
    if !depth || !matches!(h.kind, AxisKind::Y | AxisKind::Z) {
        return Vec::new();
    }
    let (x, y) = (v.value_at(up), h.value_at(across));
    let name = if h.kind == AxisKind::Y { "azimuth" } else { "elevation" };
    vec![format!("{:<15} {:>8.3} m", "range", x.hypot(y)), format!("{name:<15} {:>8.2} °", y.atan2(x).to_degrees())]
}

/// The joint drawn within 10 points of the pointer.
pub(super) fn joint_near(
    session: &Session,
    view: &View,
    o: Orientation,
    to_screen: &dyn Fn([f64; 2]) -> Pos2,
    pointer: Pos2,
) -> Option<usize> {
    let distance = |p: &Vec3| to_screen(o.unit_from_bins(view, &view.bins_of(*p))).distance(pointer);
    let positions = session.shown_positions();
    let (joint, nearest) =
        positions.iter().enumerate().map(|(i, p)| (i, distance(p))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    (nearest < 10.0).then_some(joint)
}
