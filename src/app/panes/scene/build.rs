//! The scene of a session: Gaussians and lines.

use crate::app::locate::seen_by;
use crate::app::map_image::Orientation;
use crate::app::panes::extras::Extras;
use crate::app::panes::{MovedBody, Shared};
use crate::app::theme::Tokens;
use crate::body::{Group, Pppr, Side, Skeleton};
use crate::geometry::{self, rotation_from_quaternion};
use crate::mhp::TermGroup;
use crate::radar::AxisKind;
use crate::render::shapes::{self, Stroke};
use crate::render::{Camera, LineInstance, Scene, SceneMode, SplatInstance, Vec3};
use crate::session::{Session, SplatMode};
use crate::worker::Snapshot;
use egui::Color32;

/// Seconds of motion that a velocity arrow shows.
const VELOCITY_S: f32 = 0.3;
/// Length of the longest gradient arrow, m.
const GRADIENT_M: f64 = 0.35;

/// Share of the picture that a Gaussian may take before it fades.
const LARGEST: f32 = 0.5;
/// Basins of fewer starts have no ghost.
const GHOST_SHARE: f64 = 0.03;
/// A person's number stands this far above the highest joint, m.
const ABOVE_HEAD_M: f64 = 0.12;

/// A text at a place, m.
type Label = (Vec3, String, Color32);

/// Everything that is drawn, and the texts beside it.
pub(super) fn scene(session: &Session, camera: &Camera, tokens: &Tokens, px: f32) -> (Scene, Vec<Label>) {
    let look = &session.view;
    let mut scene = Scene {
        background: rgba(tokens.canvas, 1.0),
        sigma: look.splat_sigma,
        contour: if look.splat_mode == SplatMode::Splat { 0.6 } else { 0.0 },
        largest: LARGEST,
        mode: if look.splat_mode == SplatMode::Splat { SceneMode::Splat } else { SceneMode::Ellipsoid },
        ..Scene::default()
    };
    let mut labels = Vec::new();
    if look.show_grid {
        scene.lines.extend(ground(session, tokens, px));
    }
    if look.show_frustum {
        scene.lines.extend(radar(session, tokens, px));
    }
    let skeleton = session.fit.problem.as_ref().map(|problem| &problem.skeleton);
    if let (Some(snapshot), Some(skeleton)) = (&session.fit.shown, skeleton) {
        person(&mut scene, &mut labels, session, &snapshot.params, skeleton, tokens, px);
        if look.show_velocity {
            velocities(&mut scene, session, &snapshot.params, skeleton, camera, tokens, px);
        }
        if look.show_gradients {
            gradients(&mut scene, snapshot, camera, tokens, px);
        }
    }
    if look.show_initial
        && let (Some(initial), Some(skeleton)) = (session.fit.region_pose(), skeleton)
    {
        let stroke = Stroke { color: rgba(tokens.dim, 0.6), width_px: 1.0 * px };
        bones(&mut scene.lines, skeleton, initial.positions(), &|_, _| stroke);
    }
    if look.show_truth
        && let (Some(truth), Some(dataset)) =
            (session.data.frame.as_ref().and_then(|f| f.truth.as_ref()), &session.data.dataset)
    {
        let stroke = Stroke { color: rgba(tokens.truth, 0.85), width_px: 1.5 * px };
        bones(&mut scene.lines, &dataset.info().skeleton, &truth.joints, &|_, _| stroke);
    }
    if let (Some(frame), Some(dataset)) = (&session.data.frame, &session.data.dataset) {
        let skeleton = &dataset.info().skeleton;
        for source in session.sources.list().iter().filter(|source| source.shown) {
            let stroke = Stroke { color: rgba(tokens.of_source(source), 1.0), width_px: 2.0 * px };
            let joints = source.joints_on(frame.index, skeleton.joints.len());
            bones(&mut scene.lines, skeleton, &joints, &|_, _| stroke);
        }
    }
    if look.show_baseline
        && let (Some(pin), Some(dataset)) = (session.pins.baseline(), &session.data.dataset)
    {
        let stroke = Stroke { color: rgba(tokens.pin, 0.85), width_px: 1.5 * px };
        bones(&mut scene.lines, &dataset.info().skeleton, pin.params.positions(), &|_, _| stroke);
    }
    (scene, labels)
}

/// The mean skeletons of the restart cloud's basins, that under the pointer in full; and the body where the pointer would
/// move it.
pub(super) fn explored(scene: &mut Scene, shared: &Shared<'_>, tokens: &Tokens, px: f32) {
    let session = shared.session;
    let (Some(problem), frame) = (&session.fit.problem, session.fit.frame) else { return };
    let skeleton = &problem.skeleton;
    if session.view.show_basins
        && let Some(cloud) = session.explore.restarts(frame)
    {
        // Those of single starts would hide the others.
        for (k, basin) in cloud.basins.iter().enumerate().filter(|(_, basin)| basin.share >= GHOST_SHARE) {
            let pointed = shared.pointed.basin == Some(k);
            let (alpha, width) = if pointed { (1.0, 3.0) } else { (0.25 + 0.5 * basin.share as f32, 1.5) };
            let stroke =
                Stroke { color: rgba(if k < 6 { tokens.person(k) } else { tokens.dim }, alpha), width_px: width * px };
            bones(&mut scene.lines, skeleton, &basin.mean, &|_, _| stroke);
        }
    }
    let moved = shared.pointed.moved.and_then(|moved| match moved {
        MovedBody::Floor(at) => Some(session.explore.ambiguity(frame)?.on_floor(skeleton, at)),
        MovedBody::Turned(at) => Some(session.explore.ambiguity(frame)?.turned(skeleton, at)),
        MovedBody::Slice(at) => Some(session.explore.landscape(frame)?.params_at(skeleton, &at)),
    });
    if let Some(moved) = moved {
        let stroke = Stroke { color: rgba(tokens.accent, 0.95), width_px: 2.0 * px };
        bones(&mut scene.overlay, skeleton, moved.positions(), &|_, _| stroke);
    }
}

/// The places that the cell under the pointer sees, whichever map it is of.
pub(super) fn cell(scene: &mut Scene, shared: &Shared<'_>, tokens: &Tokens, px: f32) {
    let Some((index, pixel)) = shared.pointed.cell else { return };
    let views = shared.session.seen_views();
    let Some(view) = views.get(index) else { return };
    let points = seen_by(views, view, Orientation::of(view, shared.session.view.cube), pixel);
    let stroke = |color, alpha, width| Stroke { color: rgba(color, alpha), width_px: width * px };
    let curve = |stroke: Stroke| stroke.polyline(points.iter().copied().map(vec3));
    scene.overlay.extend(curve(stroke(tokens.canvas, 0.7, 4.0)));
    scene.overlay.extend(curve(stroke(tokens.accent, 0.95, 2.0)));
}

/// What other panes draw here while they are in front.
pub(super) fn extras(
    scene: &mut Scene,
    labels: &mut Vec<Label>,
    extras: &Extras,
    (camera, session): (&Camera, &Session),
    px: f32,
) {
    for (line, color, width) in &extras.lines {
        let stroke = Stroke { color: rgba(*color, 1.0), width_px: width * px };
        scene.lines.extend(stroke.polyline(line.iter().copied().map(vec3)));
    }
    for ([from, to], color) in &extras.arrows {
        if geometry::norm(geometry::sub(*to, *from)) > 0.01 {
            let stroke = Stroke { color: rgba(*color, 1.0), width_px: 2.0 * px };
            scene.overlay.extend(shapes::arrow(vec3(*from), vec3(*to), camera.eye(), stroke));
        }
    }
    if let Some(dataset) = &session.data.dataset {
        for (joints, color, width) in &extras.skeletons {
            let stroke = Stroke { color: rgba(*color, 1.0), width_px: width * px };
            bones(&mut scene.lines, &dataset.info().skeleton, joints, &|_, _| stroke);
        }
    }
    for (at, size, color) in &extras.points {
        let stroke = Stroke { color: rgba(*color, 0.9), width_px: 1.2 * px };
        for axis in 0..3 {
            let end = |sign: f64| vec3(std::array::from_fn(|k| at[k] + if k == axis { sign * size } else { 0.0 }));
            scene.lines.push(stroke.line(end(-0.5), end(0.5)));
        }
    }
    labels.extend(extras.labels.iter().map(|(at, text, color)| (vec3(*at), text.clone(), *color)));
}

/// Who is in the scene, and in which colour: of one person the sides, of several each of them.
pub(super) fn who(session: &Session, tokens: &Tokens) -> Vec<(String, Color32)> {
    let persons = session.fit.shown.as_ref().map_or(0, |shown| shown.params.shape().persons);
    if persons < 2 {
        return vec![("left".into(), tokens.left), ("right".into(), tokens.right)];
    }
    let person = |person| session.identity(person);
    (0..persons).map(|k| (person_name(person(k)), tokens.person(person(k)))).collect()
}

fn rgba(color: Color32, alpha: f32) -> [f32; 4] {
    [f32::from(color.r()) / 255.0, f32::from(color.g()) / 255.0, f32::from(color.b()) / 255.0, alpha]
}

fn vec3(p: geometry::Vec3) -> Vec3 {
    Vec3::from(p.map(|x| x as f32))
}

fn person(
    scene: &mut Scene,
    labels: &mut Vec<Label>,
    session: &Session,
    params: &Pppr,
    skeleton: &Skeleton,
    tokens: &Tokens,
    px: f32,
) {
    let joints = skeleton.joints.len().max(1);
    // Of one person the sides have colours; of several, the persons, and the letters L and R tell the sides.
    let several = params.shape().persons > 1;
    let person_color = |person: usize| tokens.person(session.identity(person));
    for joint in 0..params.shape().total_joints() {
        let selected = session.joint == Some(joint);
        let side = skeleton.side(joint % joints);
        let color = match side {
            _ if several => person_color(joint / joints),
            Side::Middle => tokens.text,
            side => tokens.side(side),
        };
        let opacity = (0.25 + 0.6 * params.opacity(joint) as f32).min(0.9);
        let alpha = if selected { 0.95 } else { opacity };
        scene.splats.push(SplatInstance {
            center: params.position(joint).map(|x| x as f32),
            covariance: covariance(params, joint),
            color: rgba(if selected { tokens.selected } else { color }, alpha),
            id: joint as u32,
        });
        if selected {
            labels.push((vec3(params.position(joint)), skeleton.shown_name(joint % joints), tokens.text));
        }
        if let Some(text) = side_letter(&skeleton.joints[joint % joints], side) {
            labels.push((vec3(params.position(joint)), text.into(), color));
        }
    }
    bones(&mut scene.lines, skeleton, params.positions(), &|person, side| {
        let color = match side {
            _ if several => person_color(person),
            Side::Middle => tokens.dim,
            side => tokens.side(side),
        };
        Stroke { color: rgba(color, 1.0), width_px: 2.0 * px }
    });
    if several {
        for (person, body) in params.positions().chunks_exact(joints).enumerate() {
            let highest = body.iter().copied().max_by(|a, b| a[2].total_cmp(&b[2])).unwrap_or_default();
            let above = geometry::add(highest, [0.0, 0.0, ABOVE_HEAD_M]);
            labels.push((vec3(above), person_name(session.identity(person)), person_color(person)));
        }
    }
}

/// What a person is called: people count from 1.
fn person_name(identity: usize) -> String {
    format!("P{}", identity + 1)
}

/// L and R are printed at the wrists and ankles: the sides must be readable without colours.
fn side_letter(name: &str, side: Side) -> Option<&'static str> {
    let end = name.ends_with("wrist") || name.ends_with("ankle");
    match side {
        Side::Left if end => Some("L"),
        Side::Right if end => Some("R"),
        _ => None,
    }
}

/// Σ = R S Sᵀ Rᵀ as xx, xy, xz, yy, yz, zz, m²; SPEC section 2.
fn covariance(params: &Pppr, joint: usize) -> [f32; 6] {
    let r = rotation_from_quaternion(params.rotation(joint));
    let s = params.scale(joint);
    let entry = |i: usize, k: usize| (0..3).map(|c| r[i][c] * s[c] * s[c] * r[k][c]).sum::<f64>() as f32;
    [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)]
}

fn bones(
    lines: &mut Vec<LineInstance>,
    skeleton: &Skeleton,
    positions: &[geometry::Vec3],
    stroke: &dyn Fn(usize, Side) -> Stroke,
) {
    for (number, person) in positions.chunks_exact(skeleton.joints.len().max(1)).enumerate() {
        for &bone in &skeleton.bones {
            // Sources of predictions may not know every joint.
            let known = |joint: usize| person.get(joint).filter(|p| p.iter().all(|x| x.is_finite()));
            if let (Some(&a), Some(&b)) = (known(bone[0]), known(bone[1])) {
                lines.push(stroke(number, skeleton.bone_side(bone)).line(vec3(a), vec3(b)));
            }
        }
    }
}

fn velocities(
    scene: &mut Scene,
    session: &Session,
    params: &Pppr,
    skeleton: &Skeleton,
    camera: &Camera,
    tokens: &Tokens,
    px: f32,
) {
    let joints = skeleton.joints.len().max(1);
    let several = params.shape().persons > 1;
    for joint in 0..params.shape().total_joints() {
        let velocity = vec3(params.velocity(joint)) * VELOCITY_S;
        if velocity.length() > 0.01 {
            let side = tokens.side(skeleton.side(joint % joints));
            let color = if several { tokens.person(session.identity(joint / joints)) } else { side };
            let stroke = Stroke { color: rgba(color, 1.0), width_px: 1.5 * px };
            let from = vec3(params.position(joint));
            scene.lines.extend(shapes::arrow(from, from + velocity, camera.eye(), stroke));
        }
    }
}

/// −∂L/∂p split into its parts: what each group of terms wants of each joint. The longest is [`GRADIENT_M`] long.
fn gradients(scene: &mut Scene, snapshot: &Snapshot, camera: &Camera, tokens: &Tokens, px: f32) {
    let Snapshot { params, evaluation, config, .. } = snapshot;
    let descent = |group: TermGroup, joint: usize| -> geometry::Vec3 {
        let slope = evaluation.joint_gradient(group, config, Group::Position, joint);
        std::array::from_fn(|axis| -slope[axis])
    };
    let joints = 0..params.shape().total_joints();
    let parts: Vec<_> = joints.map(|joint| TermGroup::ALL.map(|group| descent(group, joint))).collect();
    let longest = parts.iter().flatten().map(|v| geometry::norm(*v)).fold(0.0, f64::max);
    if longest <= 0.0 || !longest.is_finite() {
        return;
    }
    for (joint, part) in parts.iter().enumerate() {
        let from = vec3(params.position(joint));
        for (v, color) in part.iter().zip(TermGroup::ALL.map(|group| tokens.group(group))) {
            let arrow = vec3(geometry::scale(*v, GRADIENT_M / longest));
            if arrow.length() > 0.01 {
                let stroke = Stroke { color: rgba(color, 1.0), width_px: 2.0 * px };
                scene.overlay.extend(shapes::arrow(from, from + arrow, camera.eye(), stroke));
            }
        }
    }
}

/// A grid below the lowest joint of the start pose, so that it does not move while fitting.
fn ground(session: &Session, tokens: &Tokens, px: f32) -> Vec<LineInstance> {
    let lowest =
        session.fit.initial.as_ref().map_or(-1.0, |p| p.positions().iter().map(|p| p[2]).fold(f64::INFINITY, f64::min));
    let z = if lowest.is_finite() { (lowest as f32 - 0.08).min(0.0) } else { -1.0 };
    let minor = Stroke { color: rgba(tokens.stroke, 0.9), width_px: px };
    let major = Stroke { color: rgba(tokens.dim, 0.45), width_px: px };
    shapes::grid((0, 8), (-3, 3), z, minor, major)
}

/// The radar, and its field of view as wide as the data set's angular axes say, else ±60° and ±30°.
fn radar(session: &Session, tokens: &Tokens, px: f32) -> Vec<LineInstance> {
    let widest = |kinds: &[AxisKind], otherwise: f64| {
        let axes = session.data.dataset.iter().flat_map(|d| &d.info().views).flat_map(|v| &v.axes);
        let of = axes.filter(|a| kinds.contains(&a.kind));
        let ends = of.flat_map(|a| [a.value_at(0.0).abs(), a.value_at(a.bins as f64 - 1.0).abs()]);
        let found = ends.fold(0.0, f64::max);
        (if found > 0.0 { found } else { otherwise }).min(1.4) as f32
    };
    let azimuth = widest(&[AxisKind::Azimuth, AxisKind::Cone], 60f64.to_radians());
    let elevation = widest(&[AxisKind::Elevation], 30f64.to_radians());
    let line = Stroke { color: rgba(tokens.dim, 0.35), width_px: px };
    let mut lines = shapes::frustum(azimuth, elevation, 1.2, line);
    lines.extend(shapes::radar(0.18, Stroke { color: rgba(tokens.text, 0.9), width_px: 1.5 * px }));
    lines.extend(shapes::triad(Vec3::ZERO, 0.3, 2.0 * px));
    lines
}
