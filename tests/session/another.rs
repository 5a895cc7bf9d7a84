//! Another data set: nothing that speaks of the frames and persons of the one before is left.

use crate::state::Bench;
use mhp_inspector::body::Group;
use mhp_inspector::config::{FitConfig, Preset};
use mhp_inspector::session::{Command, Session, ViewState};
use std::collections::BTreeSet;

/// What somebody may do with a data set; `n` is any number.
fn something(bench: &mut Bench, what: usize, n: usize) {
    let command = match what {
        0 => Command::SelectFrames(BTreeSet::from([n % 4, 2])),
        1 => Command::SetFilter(format!("index>={}", n % 3)),
        2 => Command::SelectJoint(Some(n % 10)),
        3 => Command::SetConfig(Box::new(FitConfig { people: n % 4, ..bench.session.config })),
        4 => Command::SetConfig(Box::new(FitConfig { w_em: 0.1 * (n % 9 + 1) as f64, ..bench.session.config })),
        5 => Command::PinFit,
        6 => Command::TogglePlay,
        7 => Command::Undo,
        8 => Command::SaveSession(format!("/tmp/nowhere-{n}.mhp-session").into(), serde_json::Value::Null),
        9 => Command::SetView(Box::new(ViewState { mask_opacity: 0.3, ..bench.session.view.clone() })),
        10 if bench.session.fit.is_ready() && !bench.session.fit.is_running() => {
            return bench.run_to(bench.session.fit.head() + 1 + n % 3);
        }
        // Somebody at another place is somebody else.
        _ => {
            let to = (bench.session.data.frame_index + 1) % 4;
            bench.params.group_mut(Group::Position).iter_mut().for_each(|p| *p += 1.0 + n as f64);
            let prepare = bench.goto(to);
            return bench.answer(prepare);
        }
    };
    bench.apply(command);
}

/// Everything that a data set's frames and persons are in.
fn of_the_data(session: &Session) -> Vec<String> {
    let Session { data, fit, labels, queue, config, pins, study, batch, .. } = session;
    vec![
        format!("frame {} playing {}", data.frame_index, data.playing),
        format!("targets {:?} {:?}", session.label_targets(), labels.selection),
        format!("filter {:?} rows {:?}", queue.text, queue.rows()),
        format!("joint {:?} people {}", session.joint, config.people),
        format!("persons {:?}", fit.identities),
        format!("fits {:?} of {} {:?}", session.fits.len(), session.summaries.len(), fit.head()),
        format!("pins {} row {:?} batch {:?}", pins.list().len(), study.row, batch.shown),
        format!("undo {:?} redo {:?} {:?}", session.undo_name(), session.redo_name(), session.undo_act()),
        format!("kept in {:?}", session.session_path),
    ]
}

#[test]
fn another_data_set_begins_as_if_it_were_the_first() {
    let first = of_the_data(&Bench::new().session);
    let mut seed = 0x2545_f491_u64;
    let mut random = move |below: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % below
    };
    for _ in 0..40 {
        let mut bench = Bench::new();
        let start = bench.params.clone();
        let done: Vec<(usize, usize)> = (0..12).map(|_| (random(12), random(100))).collect();
        for &(what, n) in &done {
            something(&mut bench, what, n);
        }
        let view = bench.session.view.clone();
        bench.params = start;
        bench.open_another();
        assert_eq!(of_the_data(&bench.session), first, "after {done:?}");
        assert_eq!(bench.session.view, view, "how things are shown stays");
    }
}

/// Nobody modified anything: the preset is the one that was chosen, and people are counted where it counts them.
#[test]
fn another_data_set_is_fitted_with_the_same_preset() {
    for preset in Preset::ALL {
        let mut bench = Bench::new();
        bench.apply(Command::SetConfig(Box::new(preset.config())));
        bench.apply(Command::SetConfig(Box::new(FitConfig { people: 3, ..preset.config() })));
        bench.open_another();
        assert_eq!(bench.session.config, preset.config(), "{}", preset.name());
    }
}
