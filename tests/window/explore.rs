//! Explorations in the window: opened, chosen, waited for, hovered and adopted; their numbers are those of fits.
#![expect(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::window::Window;
use egui::{Key, Modifiers, Pos2, pos2};
use mhp_inspector::app::Pane;
use mhp_inspector::condition::{Breakpoint, Watch};
use mhp_inspector::config::{FitConfig, Preset};
use mhp_inspector::explore::{
    ClosureRequest, ExplorationKind, ExploredState, IdleCores, Noise, RadarChange, RegionOf, RestartSettings,
    SliceAlong, TunedFrames, TunedQuantity, closure_test, leave_one_out, observability, tau_clouds, tau_ribbon,
    what_if,
};
use mhp_inspector::mhp::{ErasedCells, Fitter, connected_echo, without};
use mhp_inspector::session::{Command, Session, ViewState};
use mhp_inspector::task::Progress;
use std::sync::Arc;
use std::time::Instant;

/// Room for numbers at the left of a picture and below it, points.
const LEFT: f32 = 64.0;
const BELOW: f32 = 34.0;

/// A frame fitted with few iterations of the baseline, and a pane in front.
fn explored(frames: usize, pane: &str) -> Window {
    let mut window = Window::open(frames);
    window.switch_live_off();
    window.apply(Command::SetConfig(Box::new(FitConfig { iterations: 6, ..Preset::Baseline.config() })));
    window.apply(Command::Reset);
    window.ready(0);
    window.key(Key::Enter);
    window.paused_at(6);
    view(&mut window, |view| view.explore.tuning.quantity = TunedQuantity::Loss);
    window.harness.state_mut().show_pane(Pane::called(pane).unwrap());
    window.harness.run_steps(3);
    window
}

fn view(window: &mut Window, change: impl FnOnce(&mut ViewState)) {
    let mut view = window.session().view.clone();
    change(&mut view);
    window.apply(Command::SetView(Box::new(view)));
}

fn done(window: &mut Window, kind: ExplorationKind) {
    window.until(kind.title(), |w| {
        let explore = &w.session().explore;
        w.session().is_explored(kind) && !explore.is_running(kind) && explore.is_current(kind)
    });
    window.harness.run_steps(3);
}

/// A place in a picture, from its lower left corner.
fn inside(window: &Window, name: &str, [right, up]: [f32; 2]) -> Pos2 {
    let rect = window.harness.get_by_label(name).rect();
    pos2(rect.left() + LEFT + right, rect.bottom() - BELOW - up)
}

use egui_kittest::kittest::Queryable as _;

fn hover(window: &mut Window, at: Pos2) {
    window.harness.hover_at(at);
    window.harness.run_steps(3);
}

fn press(window: &mut Window, at: Pos2) {
    window.harness.hover_at(at);
    window.harness.drag_at(at);
    window.harness.step();
    window.harness.drop_at(at);
    window.harness.run_steps(2);
    window.until("the lifted finger", |w| !w.session().is_dragging());
}

/// The values of a tuned setting are typed over.
fn type_values(window: &mut Window, setting: usize, text: &str) {
    window.node(&format!("Values of tuned setting {setting}")).focus();
    window.harness.step();
    window.key_with(Modifiers::COMMAND, Key::A);
    window.type_text(text);
    window.key(Key::Enter);
    window.harness.run_steps(3);
}

/// Chosen, waited for, hovered; a click on a cell makes its very fit again as a branch, which can be taken back.
#[test]
fn a_cell_of_the_tuning_map_is_a_fit() {
    let mut window = explored(2, "Tuning map");
    type_values(&mut window, 1, "0.1, 0.5, 2");
    type_values(&mut window, 2, "5..20:2");
    done(&mut window, ExplorationKind::Tuning);
    let map = Arc::clone(window.session().explore.tuning().unwrap());
    assert_eq!((map.shape(), map.frames.len(), map.is_complete()), (vec![3, 2], 1, true));
    let title = "Tuning map of L over w_em and tau_pct";
    let corner = inside(&window, title, [6.0, 6.0]);
    hover(&mut window, corner);
    let said = window.text_of(title);
    let fit = map.fit(0, 0).unwrap().row.fit.clone().unwrap();
    assert!(said.starts_with(&format!("w_em 0.1, tau_pct 5: L {:.4}", fit.loss)), "{said}");
    assert!(said.contains("IoU") && said.contains("MAJPE"), "{said}");
    let before = window.session().config;
    press(&mut window, corner);
    window.paused_at(6);
    let branch = window.fit().branch().unwrap().clone();
    let end = branch.rows.last().unwrap();
    assert_eq!((end.report.loss, end.report.terms.map(Some)), (fit.loss, fit.terms), "the same fit");
    assert_eq!((branch.id, branch.config.w_em, branch.config.tau_pct), (1, 0.1, 5.0));
    assert_eq!(end.majpe_mm, fit.majpe_mm);
    assert!(
        window.session().undo_name().unwrap().contains("of the tuning map, w_EM"),
        "{:?}",
        window.session().undo_name()
    );
    window.key_with(Modifiers::COMMAND, Key::Z);
    window.paused_at(6);
    assert_eq!((window.session().config, window.fit().history.active_id()), (before, 0));
    window.key_with(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
    window.paused_at(6);
    assert_eq!((window.fit().history.active_id(), window.session().config.w_em), (1, 0.1));
    // Dragged over the map: one branch, written anew, and one act.
    let across = [0.2, 0.5, 0.8].map(|share| {
        let rect = window.harness.get_by_label(title).rect();
        pos2(rect.left() + LEFT + share * (rect.width() - LEFT - 62.0), corner.y)
    });
    window.harness.hover_at(across[0]);
    window.harness.drag_at(across[0]);
    for at in across {
        window.harness.hover_at(at);
        window.harness.run_steps(3);
    }
    window.until("the fit under the finger", |w| {
        w.session().config.w_em == 2.0 && w.fit().shown.as_ref().is_some_and(|s| s.branch == 2)
    });
    window.harness.drop_at(across[2]);
    window.until("the lifted finger", |w| !w.session().is_dragging());
    assert_eq!(window.fit().history.branches().len(), 3);
    window.click("Take the best of the tuning map");
    window.paused_at(6);
    let best = map.best(TunedQuantity::Loss).unwrap();
    assert_eq!(window.fit().branch().unwrap().config, map.variants[best].config);
}

/// One setting draws a curve; several frames their mean, or a picture each; the map is kept as the study that it is.
#[test]
fn a_tuning_map_of_frames_is_kept_as_a_study() {
    let mut window = explored(3, "Tuning map");
    window.at_rest();
    type_values(&mut window, 1, "0.1,1");
    window.click("Tuned setting 2");
    window.harness.run_steps(2);
    window.click("one setting alone");
    window.harness.run_steps(2);
    window.click("Frames of the tuning map");
    window.harness.run_steps(2);
    window.click("listed frames");
    done(&mut window, ExplorationKind::Tuning);
    let map = Arc::clone(window.session().explore.tuning().unwrap());
    assert_eq!((map.points(), map.frames.len()), (2, 3));
    assert!(map.value(0, TunedQuantity::Iou).unwrap().1 > 0.0, "frames differ");
    assert!(window.named("Tuning map of L over w_em"));
    view(&mut window, |view| view.explore.tuning.by_frame = true);
    window.harness.run_steps(3);
    assert!(window.named("Tuning map of frame frames/002"), "{:#?}", window.names());
    window.click("Tuning map of frame frames/002");
    window.ready(2);
    window.click("Keep as study");
    window.until("the run folder", |w| w.session().study.shown().is_some_and(|run| run.complete));
    let run = window.session().study.shown().unwrap();
    let kept: Vec<_> = run.rows.iter().map(|row| (row.variant, row.frame, row.fit.clone(), row.fit_ms)).collect();
    let mut mine: Vec<_> = map.rows().into_iter().map(|row| (row.variant, row.frame, row.fit, row.fit_ms)).collect();
    mine.sort_by_key(|row| (row.0, row.1));
    assert_eq!(kept, mine, "also the times: nothing was fitted again");
    assert_eq!(window.session().view.explore.tuning.frames, TunedFrames::Listed);
}

/// A session file keeps what was chosen, and what is filled again from it are the same numbers.
#[test]
fn a_session_file_keeps_what_was_explored() {
    let mut window = explored(2, "Tuning map");
    type_values(&mut window, 1, "0.1, 2");
    type_values(&mut window, 2, "5,20");
    done(&mut window, ExplorationKind::Tuning);
    let corner = inside(&window, "Tuning map of L over w_em and tau_pct", [6.0, 6.0]);
    press(&mut window, corner);
    window.paused_at(6);
    let (map, shown) = (Arc::clone(window.session().explore.tuning().unwrap()), window.fit().shown.clone().unwrap());
    view(&mut window, |view| view.explore.restarts = RestartSettings { starts: 6, ..RestartSettings::default() });
    window.apply(Command::Explore(ExplorationKind::Restarts));
    done(&mut window, ExplorationKind::Restarts);
    let share = window.session().frame_row(0).best_basin;
    assert!(share.is_some());
    let elsewhere = tempfile::tempdir().unwrap();
    let path = elsewhere.path().join("kept.mhp-session");
    window.key_with(Modifiers::COMMAND, Key::S);
    window.answer_path("Save to", &path);
    window.until("the file", |_| path.is_file());
    window.apply(Command::OpenSession(path));
    window.until("the session", |w| w.fit().history.branches().len() == 1 && w.fit().is_ready() && w.fit().head() == 6);
    window.until("its picture", |w| w.fit().shown.is_some());
    let again = window.fit().shown.clone().unwrap();
    assert_eq!((&again.params, &again.masks), (&shown.params, &shown.masks), "around the start of its own");
    assert_eq!(window.session().frame_row(0).best_basin, share);
    window.harness.state_mut().show_pane(Pane::called("Tuning map").unwrap());
    done(&mut window, ExplorationKind::Tuning);
    let filled = window.session().explore.tuning().unwrap();
    let numbers =
        |map: &mhp_inspector::explore::TuningMap| map.rows().into_iter().map(|row| row.fit).collect::<Vec<_>>();
    assert_eq!(numbers(filled), numbers(&map));
}

#[test]
fn a_slice_of_the_loss_goes_through_the_state_on_screen() {
    let mut window = explored(1, "Loss landscape");
    done(&mut window, ExplorationKind::Landscape);
    let slice = Arc::clone(window.session().explore.landscape(0).unwrap());
    assert_eq!((slice.axes[0].name.as_str(), slice.shape()), ("body along x", [241, 1]));
    let loss = window.fit().shown_row().unwrap().report.loss;
    assert_eq!(slice.value([120, 0], None), Some(loss), "its middle is the state itself");
    window.click("Direction 1");
    window.harness.run_steps(2);
    window.click("joint along z");
    window.harness.run_steps(3);
    assert!(window.says("select a joint"), "{:#?}", window.names());
    window.apply(Command::SelectJoint(Some(9)));
    done(&mut window, ExplorationKind::Landscape);
    assert!(window.session().explore.landscape(0).unwrap().axes[0].name.contains("wrist along z"));
    // Over two directions, and a branch from a minimum.
    view(&mut window, |view| {
        (view.explore.landscape.along, view.explore.landscape.and) = (SliceAlong::BodyY, Some(SliceAlong::BodyX));
    });
    done(&mut window, ExplorationKind::Landscape);
    let slice = Arc::clone(window.session().explore.landscape(0).unwrap());
    assert_eq!(slice.value([40, 40], None), Some(loss));
    let title = "Loss landscape of L over body along y and body along x";
    let at = inside(&window, title, [20.0, 20.0]);
    hover(&mut window, at);
    assert!(window.text_of(title).contains("body along y −"), "{}", window.text_of(title));
    window.harness.remove_cursor();
    window.harness.step();
    let link = window.names().into_iter().find(|name| name.starts_with("Minimum 1 at ")).unwrap();
    window.click(&link);
    window.paused_at(6);
    let minimum = slice.minima(None)[0];
    let places: Vec<f64> = slice.axes.iter().zip(minimum.cell).map(|(axis, k)| axis.at(k as f64)).collect();
    let skeleton = &window.fit().problem.as_ref().unwrap().skeleton;
    let begun = window.fit().branch().unwrap();
    assert_eq!(begun.id, 1);
    assert_eq!(begun.rows[0].state.as_ref().unwrap().params, slice.params_at(skeleton, &places));
    assert_eq!(begun.rows[0].report.loss, minimum.value);
}

#[test]
fn between_two_pins_the_ends_are_the_pins() {
    let mut window = explored(1, "Loss landscape");
    window.key(Key::P);
    window.apply(Command::GotoIteration(0));
    window.until("the start", |w| w.fit().shown.as_ref().is_some_and(|shown| shown.iteration == 0));
    view(&mut window, |view| view.explore.landscape.along = SliceAlong::Pins);
    done(&mut window, ExplorationKind::Landscape);
    let slice = window.session().explore.landscape(0).unwrap();
    let at = |value: f64| slice.value([slice.axes[0].place(value).round() as usize, 0], None).unwrap();
    let pinned = window.session().pins.list()[0].rows.last().unwrap().report.loss;
    assert_eq!(at(0.0), pinned);
    let start = window.fit().history.branches()[0].rows[0].report.loss;
    assert!((at(1.0) - start).abs() < 1e-4 * start, "{} {start}", at(1.0));
    assert!(window.named("From pin") && window.named("To pin"));
}

#[test]
fn the_ambiguity_map_lists_places_and_a_branch_begins_at_one() {
    let mut window = explored(1, "Ambiguity map");
    window.apply(Command::Explore(ExplorationKind::Ambiguity));
    done(&mut window, ExplorationKind::Ambiguity);
    let map = Arc::clone(window.session().explore.ambiguity(0).unwrap());
    let shown = window.fit().shown_row().unwrap().report.terms.get("em").unwrap();
    assert!((map.floor.here_value - shown).abs() < 1e-6, "{} {shown}", map.floor.here_value);
    let lowest = map.floor.minima[0];
    assert!(lowest.value < map.floor.here_value + 0.05, "the body is near a minimum of its own echo");
    for name in ["L_EM over the floor", "L_EM over heading and height"] {
        let rect = window.harness.get_by_label(name).rect();
        hover(&mut window, rect.center());
        assert!(window.text_of(name).contains("L_EM 0."), "{name}: {}", window.text_of(name));
    }
    window.harness.remove_cursor();
    window.harness.run_steps(2);
    let link = window.names().into_iter().find(|name| name.starts_with("Minimum 1 at x")).unwrap();
    window.click(&link);
    window.paused_at(6);
    let begun = window.fit().branch().unwrap();
    let place = map.floor.at(lowest.cell);
    let skeleton = &window.fit().problem.as_ref().unwrap().skeleton;
    assert_eq!(begun.rows[0].state.as_ref().unwrap().params, map.on_floor(skeleton, place));
    assert!(begun.around.is_some(), "with an EM region of its own");
    // Only what the fit itself sees.
    window.click("of the fit");
    window.apply(Command::Explore(ExplorationKind::Ambiguity));
    done(&mut window, ExplorationKind::Ambiguity);
    assert_eq!(window.session().explore.ambiguity(0).unwrap().region, RegionOf::Fit);
}

#[test]
fn restarts_end_in_basins_that_can_be_taken() {
    let mut window = explored(1, "Restart cloud");
    view(&mut window, |view| view.explore.restarts = RestartSettings { starts: 16, ..RestartSettings::default() });
    done(&mut window, ExplorationKind::Restarts);
    let cloud = Arc::clone(window.session().explore.restarts(0).unwrap());
    assert!(cloud.is_complete() && cloud.done == 16);
    let own = cloud.restarts[0].as_ref().unwrap();
    let fitted = window.fit().shown.clone().unwrap();
    assert_eq!(
        (own.loss, own.end.positions()),
        (fitted.evaluation.loss, fitted.params.positions()),
        "the first is the fit itself"
    );
    let share: f64 = cloud.basins.iter().map(|basin| basin.share).sum();
    assert!((share - 1.0).abs() < 1e-9);
    assert_eq!(window.session().frame_row(0).best_basin, cloud.best_share());
    assert!(window.named("Sort by Best basin"), "{:#?}", window.names());
    window.apply(Command::SetFilter("basin<0".into()));
    assert!(window.session().queue.rows().is_empty());
    window.apply(Command::SetFilter("basin>=0".into()));
    assert_eq!(window.session().queue.rows(), [0]);
    // Its mean body is brought out in 3-D while it is pointed at, here or on the plot of the ends.
    window.node("Take basin 1").hover();
    window.harness.run_steps(3);
    let told = format!("mean body of basin 1: {:.0} % of the starts", 100.0 * cloud.basins[0].share);
    assert_eq!(window.text_of("3-D scene"), told);
    window.click("Take basin 1");
    window.paused_at(6);
    let best = cloud.restarts[cloud.basins[0].members[0]].as_ref().unwrap();
    let taken = window.fit().shown.clone().unwrap();
    assert_eq!((taken.evaluation.loss, taken.params.positions()), (best.loss, best.end.positions()), "the same fit");
    assert_eq!(window.fit().history.active_id(), 1);
    assert!(window.session().undo_name().unwrap().starts_with("restart "));
}

/// On two cores nothing is left beside a run and the window: explorations wait, and go on when it has ended.
#[test]
fn explorations_make_way_for_a_run() {
    if std::thread::available_parallelism().is_ok_and(|cores| cores.get() > 2) {
        println!("skipped: with more than two cores explorations go on beside a run");
        return;
    }
    let mut window = explored(1, "Curves");
    window.run_forever();
    window.apply(Command::Explore(ExplorationKind::Restarts));
    window.harness.run_steps(30);
    assert!(window.session().explore.is_running(ExplorationKind::Restarts) && window.session().needs_cores());
    assert!(window.session().explore.restarts(0).is_none(), "no fit was begun");
    // A newer request takes the place of the older one, and can be stopped while it waits.
    window.apply(Command::Explore(ExplorationKind::Restarts));
    window.apply(Command::StopExploring(ExplorationKind::Restarts));
    window.until("its end", |w| !w.session().explore.any_running());
    assert!(window.fit().is_running());
}

/// Prints, on the sample and on a real frame where it is at hand: when the first picture of each exploration is there and when all
/// of it; and what a run costs with and without explorations beside it.
#[test]
#[ignore = "prints figures of this machine; run it alone, with --nocapture"]
fn figures() {
    use std::path::Path;
    use std::sync::Mutex;
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sets = [(root.join("samples/walk"), 3), (root.join("../shared/data/mmvr"), 0)];
    for (path, frame) in sets {
        if !path.exists() {
            println!("skipped: {} is not there", path.display());
            continue;
        }
        let mut window = Window {
            harness: Window::empty(std::slice::from_ref(&path), [1440.0, 900.0]),
            folder: tempfile::tempdir().unwrap(),
        };
        window.until("the data set", |w| w.session().data.dataset.is_some() && w.fit().is_ready());
        for preset in [Preset::Recommended, Preset::Baseline] {
            let config = preset.config();
            let steps = config.iterations.min(100);
            window.apply(Command::SetConfig(Box::new(config)));
            window.apply(Command::GotoFrame(frame));
            window.ready(frame);
            window.apply(Command::Reset);
            window.ready(frame);
            window.apply(Command::StepFit(steps));
            window.paused_at(steps);
            view(&mut window, |view| {
                view.explore.landscape.and = Some(SliceAlong::BodyY);
            });
            let cores = std::thread::available_parallelism().unwrap();
            println!("{} frame {frame}, {}, {cores} cores", path.display(), preset.name());
            for kind in ExplorationKind::ALL {
                let request = window.session().exploration(kind).unwrap();
                let (began, first) = (Instant::now(), Mutex::new(None));
                let look = |_| {
                    first.lock().unwrap().get_or_insert_with(|| began.elapsed());
                };
                request.explore(&IdleCores::all(), &Progress::new(), &look).unwrap();
                let seconds = |of: std::time::Duration| format!("{:.2} s", of.as_secs_f64());
                let first = first.lock().unwrap().unwrap_or_default();
                println!("  {:<16} first {:>7}  all {:>7}", kind.title(), seconds(first), seconds(began.elapsed()));
            }
            if preset == Preset::Recommended {
                rests_on(&window.session().explored_state().unwrap(), window.session());
            }
        }
        let mut took = [Vec::new(), Vec::new()];
        for k in 0..10 {
            if k % 2 == 1 {
                window.apply(Command::Explore(ExplorationKind::Restarts));
            }
            let head = window.fit().head();
            window.apply(Command::StepFit(4000));
            window.paused_at(head + 4000);
            took[k % 2].push(window.fit().run_ms.unwrap());
            window.apply(Command::StopExploring(ExplorationKind::Restarts));
            window.until("its end", |w| !w.session().explore.any_running());
            window.apply(Command::Reset);
            window.ready(frame);
        }
        for ms in &mut took {
            ms.sort_by(f64::total_cmp);
        }
        println!(
            "  4000 iterations alone {:.0} ms, with 200 restarts asked for meanwhile {:.0} ms (medians of 5)",
            took[0][2], took[1][2]
        );
    }
}

/// The same of what a fit rests on: how long each takes on all cores, and what it says.
fn rests_on(state: &ExploredState, session: &Session) {
    let (cores, progress) = (IdleCores::all(), Progress::new());
    let info = session.data.dataset.as_ref().unwrap().info();
    let told = |name: &str, began: Instant, says: String| {
        println!("  {name:<16} all {:>6.3} s  {says}", began.elapsed().as_secs_f64());
    };
    let began = Instant::now();
    let worth = leave_one_out(state, (&cores, &progress)).unwrap();
    let most = &worth.joints[0];
    let name = state.problem.skeleton.shown_name(most.joint % state.problem.skeleton.joints.len());
    told("who lit it", began, format!("IoU {:.3}, most missed: {name}, {:+.3}", worth.iou.unwrap(), -most.drop));

    let began = Instant::now();
    let known = observability(state, Noise::Measured, (&cores, &progress)).unwrap();
    let unseen = &known.unseen[0];
    let says = format!(
        "the echo fixes {:.1} of {:.0} directions, refits ±{:.1} mm; least: {} ±{:.0} mm",
        known.fixed[0], known.fixed[1], known.spread_mm[0], unseen.name, unseen.spread_mm
    );
    told("radar knows", began, says);

    let began = Instant::now();
    let change = RadarChange { elements: Some(172), ..RadarChange::default() };
    let seen = what_if(info, state, &vec![change; info.views.len()], (&cores, &progress)).unwrap();
    let [a, b] = [&seen.today, &seen.other].map(|seen| seen.known.spread_mm[0]);
    told("radar what-if", began, format!("172 elements: refits ±{a:.1} → ±{b:.1} mm"));

    let began = Instant::now();
    let request = ClosureRequest {
        info: Arc::new(info.clone()),
        pose: state.params.clone(),
        config: state.config,
        precision: state.precision,
        noise: 0.02,
        seed: 1,
    };
    let test = closure_test(&request, (&cores, &progress)).unwrap();
    let [start, fit] = test.errors;
    told(
        "closure test",
        began,
        format!("MAJPE {:.0} → {:.0} mm, PA {:.0} mm", start.majpe_mm, fit.majpe_mm, fit.pa_majpe_mm),
    );

    let shown = session.fit.shown.as_ref().unwrap();
    let maps: Vec<(&[f64], &[f64])> =
        shown.h_sim.iter().enumerate().map(|(k, sim)| (state.problem.map(k), sim.as_slice())).collect();
    let began = Instant::now();
    let ribbon = tau_ribbon(&maps, &shown.masks);
    let (best, telling) = (ribbon.best().unwrap(), ribbon.most_telling().unwrap());
    told(
        "τ ribbon",
        began,
        format!("largest IoU {:.3} at {} %, farthest from chance at {} %", best.1, best.0, telling.0),
    );
    let began = Instant::now();
    let clouds = tau_clouds(state, (&shown.h_sim, &shown.masks), (&cores, &progress)).unwrap();
    let [cfar, threshold, pppr] = [&clouds.cfar, &clouds.threshold, &clouds.pppr].map(Vec::len);
    told("τ clouds", began, format!("{cfar} points by CFAR, {threshold} above τ, {pppr} of PPPR-PC"));

    // The strongest echo goes, and the fit is done anew.
    let largest =
        (0..state.problem.map(0).len()).max_by(|a, b| state.problem.map(0)[*a].total_cmp(&state.problem.map(0)[*b]));
    let view = &state.problem.views[0];
    let began = Instant::now();
    let cells = connected_echo((view, state.problem.map(0)), None, 2.0, largest.unwrap());
    let erased = ErasedCells::of_cells((0, view), cells).unwrap();
    let seen = without(&state.problem, std::slice::from_ref(&erased)).unwrap();
    let mut fitter = Fitter::new(seen, state.config, state.precision, state.initial.clone()).unwrap();
    fitter.run_unseen(state.config.iterations, |_| false).unwrap();
    let moved = fitter.params().positions().iter().zip(state.params.positions());
    let moved: Vec<f64> =
        moved.map(|(a, b)| 1000.0 * a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()).collect();
    let mean = moved.iter().sum::<f64>() / moved.len() as f64;
    told("eraser", began, format!("{} cells of {}: the pose moves {mean:.0} mm", erased.count(), view.array));

    let began = Instant::now();
    let breakpoint: Breakpoint = "step_mm<1".parse().unwrap();
    let mut fitter =
        Fitter::new(Arc::clone(&state.problem), state.config, state.precision, state.initial.clone()).unwrap();
    let mut watch = Watch::new(vec![breakpoint]);
    watch.begin(&fitter, None);
    fitter
        .run_until(state.config.iterations, |fitter| fitter.iteration() > 0 && watch.step(fitter, None).is_some())
        .unwrap();
    told("breakpoint", began, format!("step_mm<1 stops at iteration {}", fitter.iteration()));
}
