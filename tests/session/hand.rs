//! The body in a hand: H_sim follows, and what the hand did is one act.

use crate::live::Rig;
use mhp_inspector::config::FitConfig;
use mhp_inspector::geometry::{add, norm, sub};
use mhp_inspector::session::{BodyMove, Command, FitStatus, Live, LogLevel};

/// COCO's joints: one at the end of a limb, one of the trunk.
const RIGHT_WRIST: usize = 10;
const NOSE: usize = 0;

impl Rig {
    fn joint(&self, joint: usize) -> [f64; 3] {
        self.session().shown_positions()[joint]
    }

    /// Moves a joint by so much from where it was in so many small moves.
    fn move_joint(&mut self, joint: usize, by: [f64; 3], moves: usize) {
        let from = self.joint(joint);
        for k in 1..=moves {
            let to = add(from, by.map(|x| x * k as f64 / moves as f64));
            self.runtime.apply(Command::DragBody(BodyMove::Joint { joint, to, keep_bones: false }));
            self.runtime.poll();
        }
    }

    /// The finger is lifted, and the worker has done what it asked last.
    fn lifted(&mut self, joint: usize, at: [f64; 3]) {
        self.runtime.apply(Command::EndDrag);
        self.shows(joint, at);
    }

    fn shows(&mut self, joint: usize, at: [f64; 3]) {
        self.until("the joint where it was put", |s| norm(sub(s.shown_positions()[joint], at)) < 1e-12);
    }
}

#[test]
fn a_joint_in_a_hand_is_one_branch_one_line_and_one_act() {
    let mut rig = Rig::new(Live::Off);
    rig.runtime.apply(Command::ToggleRun);
    rig.settled();
    let before = rig.session().fit.shown.clone().unwrap();
    let at = before.params.position(RIGHT_WRIST);
    rig.move_joint(RIGHT_WRIST, [0.3, 0.0, 0.1], 30);
    assert!(rig.session().is_dragging() && rig.session().is_moving());
    let to = add(at, [0.3, 0.0, 0.1]);
    rig.shows(RIGHT_WRIST, to);
    let shown = rig.session().fit.shown.clone().unwrap();
    assert!(shown.h_sim != before.h_sim && shown.evaluation.loss != before.evaluation.loss, "H_sim follows");
    rig.lifted(RIGHT_WRIST, to);
    let fit = &rig.session().fit;
    let branches: Vec<_> = fit.history.branches().iter().map(|b| (b.id, b.parent, b.rows.len())).collect();
    assert_eq!(branches, [(0, None, 13), (1, Some((0, 12)), 1)], "one row, however many moves");
    assert_eq!(fit.history.departure(fit.branch().unwrap()), "right wrist moved 0.32 m");
    assert_eq!(rig.lines("right wrist moved 0.32 m"), 1, "{:?}", rig.session().log);
    assert_eq!(rig.session().undo_name(), Some("right wrist moved 0.32 m"));

    // In one order with acts on settings.
    rig.runtime.apply(Command::SetConfig(Box::new(FitConfig { w_em: 2.0, ..rig.session().config })));
    rig.settled();
    rig.runtime.apply(Command::Undo);
    rig.settled();
    assert_eq!(rig.session().config.w_em, 0.5);
    rig.runtime.apply(Command::Undo);
    rig.shows(RIGHT_WRIST, at);
    assert_eq!((rig.session().fit.history.active_id(), rig.session().undo_name()), (0, None));
    assert!(rig.session().fit.shown.as_ref().unwrap().params == before.params);
    rig.runtime.apply(Command::Redo);
    rig.shows(RIGHT_WRIST, to);
    // A run goes on from there.
    rig.runtime.apply(Command::ToggleRun);
    rig.settled();
    assert!(rig.session().fit.branch().unwrap().rows.len() > 1);
    assert_eq!(rig.session().fit.branch().unwrap().id, 1);
}

#[test]
fn a_hand_that_comes_back_did_nothing() {
    let mut rig = Rig::new(Live::Off);
    let from = rig.joint(RIGHT_WRIST);
    for to in [add(from, [0.2, 0.0, 0.0]), from] {
        rig.runtime.apply(Command::DragBody(BodyMove::Joint { joint: RIGHT_WRIST, to, keep_bones: true }));
    }
    rig.lifted(RIGHT_WRIST, from);
    assert_eq!((rig.session().fit.history.branches().len(), rig.session().undo_name()), (1, None));
    assert_eq!((rig.joint(RIGHT_WRIST), rig.lines("moved")), (from, 0));
}

#[test]
fn a_body_is_moved_at_an_earlier_iteration_and_undone_to_it() {
    let mut rig = Rig::new(Live::Off);
    rig.runtime.apply(Command::ToggleRun);
    rig.settled();
    rig.runtime.apply(Command::GotoIteration(5));
    rig.until("iteration 5", |s| s.fit.shown.as_ref().is_some_and(|shown| shown.iteration == 5));
    let nose = rig.joint(NOSE);
    let by = [0.0, 0.25, 0.0];
    rig.runtime.apply(Command::DragBody(BodyMove::Person { person: 0, by, yaw: 0.0 }));
    rig.lifted(NOSE, add(nose, by));
    assert_eq!(rig.session().fit.branch().unwrap().parent, Some((0, 5)));
    assert_eq!(rig.session().undo_name(), Some("body moved 0.25 m"));
    rig.runtime.apply(Command::Undo);
    rig.until("iteration 5 again", |s| {
        s.fit.cursor == Some(5) && s.fit.shown.as_ref().is_some_and(|shown| shown.branch == 0 && shown.iteration == 5)
    });
    assert_eq!(rig.joint(NOSE), nose);
}

/// What follows a setting from the start begins at the body as it was moved there.
#[test]
fn a_live_fit_begins_at_the_body_that_was_moved() {
    let mut rig = Rig::new(Live::On);
    let to = add(rig.joint(RIGHT_WRIST), [0.1, 0.0, 0.0]);
    rig.move_joint(RIGHT_WRIST, [0.1, 0.0, 0.0], 3);
    rig.lifted(RIGHT_WRIST, to);
    rig.runtime.apply(Command::SetConfig(Box::new(FitConfig { w_em: 2.0, ..rig.session().config })));
    rig.settled();
    let branch = rig.session().fit.branch().unwrap();
    assert_eq!((branch.parent, branch.start(), branch.head()), (Some((1, 0)), 0, 12));
}

#[test]
fn what_cannot_be_moved_is_told_once() {
    let mut rig = Rig::new(Live::Off);
    rig.runtime.apply(Command::SetConfig(Box::new(FitConfig { iterations: 100_000, ..rig.session().config })));
    rig.runtime.apply(Command::ToggleRun);
    rig.until("a run", |s| s.fit.head() > 2);
    rig.move_joint(RIGHT_WRIST, [0.1, 0.0, 0.0], 5);
    assert_eq!(rig.lines("pause the run to move the body"), 1);
    assert!(rig.session().is_dragging() && !rig.session().is_moving());
    rig.runtime.apply(Command::EndDrag);
    assert!(!rig.session().is_dragging());
    rig.runtime.apply(Command::ToggleRun);
    rig.until("the pause", |s| s.fit.status == FitStatus::Paused);
    assert_eq!(rig.session().fit.history.branches().len(), 1);
}

/// Undone from another frame it is undone all the same; after a reset its branch is gone, and that is said.
#[test]
fn a_move_is_undone_from_another_frame_and_not_after_a_reset() {
    let mut rig = Rig::new(Live::Off);
    let from = rig.joint(RIGHT_WRIST);
    let to = add(from, [0.1, 0.0, 0.0]);
    rig.move_joint(RIGHT_WRIST, [0.1, 0.0, 0.0], 2);
    rig.lifted(RIGHT_WRIST, to);
    let there =
        |s: &mhp_inspector::session::Session, frame| s.fit.frame == frame && s.fit.is_ready() && s.fit.shown.is_some();
    rig.runtime.apply(Command::GotoFrame(1));
    rig.until("the other frame", |s| there(s, 1));
    rig.runtime.apply(Command::Undo);
    rig.runtime.apply(Command::GotoFrame(0));
    rig.until("the frame again", |s| there(s, 0));
    assert_eq!(rig.joint(RIGHT_WRIST), from);
    rig.runtime.apply(Command::Redo);
    rig.shows(RIGHT_WRIST, to);
    rig.runtime.apply(Command::Reset);
    rig.until("a new start", |s| there(s, 0));
    rig.runtime.apply(Command::Undo);
    let last = rig.session().log.iter().rev().find(|line| line.level == LogLevel::Warning).unwrap();
    assert!(last.text.contains("is gone"), "{last:?}");
}
