//! The fitter's contract: what a step reports, going back, editing, changing the configuration, refusing to diverge.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use crate::cases::Case;
use crate::reading::case_folders;
use mhp_inspector::body::Group;
use mhp_inspector::config::{EmRegion, FitConfig, Parameterization};
use mhp_inspector::geometry::{norm, sub};
use mhp_inspector::mhp::{
    FitError, FitState, Fitter, GivenStart, Objective, Precision, Problem, Region, TermId, masks, simulate,
};
use mhp_inspector::radar::View;
use std::sync::Arc;

fn case(name: &str) -> Case {
    Case::open(&case_folders().into_iter().find(|folder| folder.ends_with(name)).unwrap())
}

fn fitter(case: Case) -> Fitter {
    Fitter::new(Arc::new(case.problem), case.config, Precision::F64, case.params).unwrap()
}

#[test]
fn a_report_is_of_the_parameters_after_its_steps() {
    let mut fitter = fitter(case("polar-two-views"));
    assert_eq!(fitter.report().iteration, 0);
    let first = fitter.report().loss;
    for k in 1..=20 {
        let report = fitter.step().unwrap();
        assert_eq!((report.iteration, fitter.iteration()), (k, k));
        assert_eq!(report.loss, fitter.evaluation().loss);
    }
    let again = case("polar-two-views");
    let mut objective = Objective::new(Arc::new(again.problem), again.config, Precision::F64, &again.params).unwrap();
    assert_eq!(objective.evaluate(fitter.params()).loss, fitter.report().loss, "same region, same loss");
    assert!(fitter.report().loss < first, "twenty steps go down: {first} to {}", fitter.report().loss);
}

#[test]
fn the_first_step_moves_every_parameter_with_a_gradient_by_the_rate() {
    let mut fitter = fitter(case("polar-two-views"));
    let (before, gradient) = (fitter.params().clone(), fitter.evaluation().gradient.clone());
    fitter.step().unwrap();
    for group in Group::ALL {
        let moved = fitter.params().group(group).iter().zip(before.group(group)).zip(gradient.group(group));
        for ((after, before), &g) in moved {
            let want = -1e-3 * g / (g.abs() + 1e-8);
            assert!((after - before - want).abs() < 1e-12, "{}", group.key());
        }
    }
}

/// The objective alone may want a Gaussian as large as the room.
#[test]
fn no_step_grows_a_gaussian_beyond_a_part_of_a_body() {
    for precision in [Precision::F64, Precision::F32] {
        let Case { problem, mut config, mut params } = case("polar-two-views");
        let wide = 3;
        params.set_vec3(Group::LogScale, wide, [0.4_f64.ln(); 3]);
        let largest = |params: &mhp_inspector::body::Pppr, of_wide: bool| {
            let joints = (0..params.shape().total_joints()).filter(|&joint| (joint == wide) == of_wide);
            joints.flat_map(|joint| params.scale(joint)).fold(0.0, f64::max)
        };
        config.scale_max_m = 1.05 * largest(&params, false);
        config.learning_rates.log_scale = Some(0.1);
        let most = config.scale_max_m * (1.0 + 1e-12);
        let mut fitter = Fitter::new(Arc::new(problem), config, precision, params).unwrap();
        let mut held = false;
        for _ in 0..30 {
            let before = largest(fitter.params(), true);
            fitter.step().unwrap();
            let (wide, others) = (largest(fitter.params(), true), largest(fitter.params(), false));
            assert!(others <= most && wide <= before.max(most), "{others} m, {wide} m after {before} m");
            held |= others > 0.999 * config.scale_max_m;
        }
        assert!(held, "nothing grew so far that it had to be held");
    }
}

#[test]
fn restoring_a_state_repeats_the_run_bit_for_bit() {
    let mut fitter = fitter(case("range-doppler"));
    for _ in 0..3 {
        fitter.step().unwrap();
    }
    let state = fitter.state();
    let first: Vec<_> = (0..4).map(|_| fitter.step().unwrap()).collect();
    fitter.restore(state.clone()).unwrap();
    assert_eq!((fitter.iteration(), fitter.state()), (3, state));
    let second: Vec<_> = (0..4).map(|_| fitter.step().unwrap()).collect();
    assert_eq!(first, second);
}

#[test]
fn a_changed_configuration_counts_from_the_current_parameters_on() {
    let mut fitter = fitter(case("polar-two-views"));
    fitter.step().unwrap();
    let (before, region) = (fitter.report(), fitter.objective().regions().to_vec());
    let config = FitConfig { w_em: 2.0, tau_pct: 20.0, ..*fitter.config() };
    fitter.set_config(config).unwrap();
    let after = fitter.report();
    assert_eq!((after.iteration, fitter.config()), (1, &config));
    let [em, bone] = ["em", "bone"].map(|key| TermId::of(key).unwrap());
    assert_eq!(after.terms[bone], before.terms[bone]);
    assert!(after.loss != before.loss && after.terms[em] != before.terms[em]);
    assert_eq!(fitter.objective().regions(), region, "the region is that of the initial persons");
    fitter.set_config(FitConfig { em_region: EmRegion::Full, ..config }).unwrap();
    let whole: Vec<Region> = fitter.objective().problem().views.iter().map(Region::whole).collect();
    assert_eq!(fitter.objective().regions(), whole);
}

#[test]
fn edited_parameters_start_new_moments() {
    let mut fitter = fitter(case("polar-two-views"));
    fitter.step().unwrap();
    let mut edited = fitter.params().clone();
    edited.group_mut(Group::Position)[0] += 0.1;
    fitter.set_params(edited.clone()).unwrap();
    assert_eq!((fitter.iteration(), fitter.params()), (1, &edited));
    assert_eq!(fitter.state().adam.steps, 0);
    assert!(fitter.state().adam.first.group(Group::Position).iter().all(|&m| m == 0.0));
}

#[test]
fn joints_that_were_given_are_held_there_and_what_the_program_found_is_not() {
    let begun = |given: bool, w_given: f64| {
        let Case { problem, config, params } = case("polar-two-views");
        let state = if given { FitState::given(GivenStart::whole(params)) } else { FitState::at_start(params) };
        let config = FitConfig { w_given, ..config };
        Fitter::starting_at(Arc::new(problem), config, Precision::F64, state).unwrap()
    };
    let given = TermId::of("given").unwrap();
    let went_m = |fitter: &mut Fitter| {
        let before = fitter.params().positions().to_vec();
        (0..40).for_each(|_| drop(fitter.step().unwrap()));
        before.iter().zip(fitter.params().positions()).map(|(a, b)| norm(sub(*a, *b))).sum::<f64>()
    };
    let (mut free, mut unweighed, mut held) = (begun(false, 10.0), begun(true, 0.0), begun(true, 10.0));
    assert_eq!(
        (held.report().terms[given], held.report().loss),
        (0.0, free.report().loss),
        "it begins where it was given"
    );
    let [free_m, unweighed_m, held_m] = [&mut free, &mut unweighed, &mut held].map(went_m);
    assert_eq!((free.report().terms[given], unweighed_m), (0.0, free_m));
    assert!(held.report().terms[given] > 0.0 && held_m < 0.5 * free_m, "{held_m} m, {free_m} m without");

    // Kept with the state: as a session keeps it, the fit goes on bit for bit.
    let kept = serde_json::to_string(&*held.state()).unwrap();
    held.step().unwrap();
    let mut again = begun(false, 10.0);
    again.restore(Arc::new(serde_json::from_str(&kept).unwrap())).unwrap();
    again.step().unwrap();
    assert_eq!(again.state(), held.state());

    // Whom a hand moves is given; how bright somebody is says nothing of it.
    let mut edited = free.params().clone();
    edited.group_mut(Group::Beta)[0] += 0.1;
    free.set_params(edited.clone()).unwrap();
    assert!(free.state().given.iter().all(Option::is_none));
    edited.group_mut(Group::Position)[3] += 0.1;
    free.set_params(edited.clone()).unwrap();
    let there: Vec<_> = edited.positions().iter().copied().map(Some).collect();
    assert_eq!(free.state().given, there);
}

#[test]
fn whom_a_hand_leaves_in_place_is_not_given() {
    let Case { problem, config, params } = case("cartesian-two-persons");
    // Masks are explained by anybody: the fit is in a window.
    let config = FitConfig { parameterization: Parameterization::Motion, ..config };
    let mut fitter = Fitter::new(Arc::new(problem), config, Precision::F64, params).unwrap();
    let (base, joints) = (fitter.params().clone(), fitter.params().shape().joints);
    // A finger goes on from where it went down, and the window puts both a little elsewhere each time.
    for by_m in [0.02, 0.04] {
        let mut moved = base.clone();
        for joint in 0..joints {
            let [x, y, z] = base.position(joint);
            moved.set_vec3(Group::Position, joint, [x, y - by_m, z]);
        }
        fitter.set_params(moved).unwrap();
    }
    assert!(!fitter.is_held() && fitter.params().person(1) != base.person(1));
    // What is on screen now is edited otherwise.
    let mut brighter = fitter.params().clone();
    brighter.group_mut(Group::Beta)[0] += 0.1;
    fitter.set_params(brighter).unwrap();
    let state = fitter.state();
    let (one, other) = state.given.split_at(joints);
    assert!(one.iter().all(Option::is_some) && other.iter().all(Option::is_none));
}

#[test]
fn divergence_names_joint_and_term_and_changes_nothing() {
    let mut fitter = fitter(case("polar-two-views"));
    fitter.step().unwrap();
    let (state, evaluation) = (fitter.state(), fitter.evaluation().clone());
    let mut broken = fitter.params().clone();
    broken.joint_mut(Group::Velocity, 9)[1] = f64::NAN;
    let error = fitter.set_params(broken).unwrap_err();
    let want = FitError::Diverged { iteration: 1, joint: "left wrist".into(), term: "velocity".into() };
    assert_eq!(error, want);

    let mut huge = fitter.params().clone();
    huge.joint_mut(Group::LogScale, 3)[0] = 800.0;
    let error = fitter.set_params(huge).unwrap_err();
    assert!(matches!(error, FitError::Diverged { .. }), "{error}");
    assert_eq!((fitter.state(), fitter.evaluation()), (state, &evaluation));
    fitter.step().unwrap();
}

#[test]
fn wrong_sizes_are_refused_by_name() {
    let good = case("polar-two-views");
    let other = case("range-doppler");
    let error = Fitter::new(Arc::new(good.problem), good.config, Precision::F64, other.params).err().unwrap();
    assert!(matches!(error, FitError::WrongParameters { what: "doppler_features", .. }), "{error}");
}

#[test]
fn problems_are_checked() {
    let Case { problem, .. } = case("polar-two-views");
    let maps: Vec<Vec<f64>> = (0..2).map(|view| problem.map(view).to_vec()).collect();
    let with = |views: Vec<View>, a: &[f64], b: &[f64]| {
        Problem::new(problem.radar.clone(), problem.skeleton.clone(), views, &[a, b]).unwrap_err().to_string()
    };
    let text = with(problem.views.to_vec(), &maps[0][1..], &maps[1]);
    assert!(text.contains(&problem.views[0].array) && text.contains(&maps[0].len().to_string()), "{text}");
    let text = with(problem.views.to_vec(), &maps[0], &vec![f64::NAN; maps[1].len()]);
    assert!(text.contains("no finite cell") && text.contains(&problem.views[1].array), "{text}");
    let mut views = problem.views.to_vec();
    views[0].region = Some(vec![[0, 5], [7, 100_000]]);
    assert!(with(views, &maps[0], &maps[1]).contains("100000"));
    let mut views = problem.views.to_vec();
    views[1].axes[0].hi = views[1].axes[0].lo;
    assert!(with(views, &maps[0], &maps[1]).contains("no extent"));
}

/// A body outside the map: the axis that sees nothing of it is used whole, and somebody is told.
#[test]
fn an_empty_region_is_widened_with_a_warning() {
    let mut case = case("polar-two-views");
    case.config.em_region = EmRegion::HalfWidth(1.0);
    for p in case.params.group_mut(Group::Position).chunks_exact_mut(3) {
        p[0] += 100.0;
    }
    let problem = Arc::new(case.problem);
    let objective = Objective::new(Arc::clone(&problem), case.config, Precision::F64, &case.params).unwrap();
    let range = problem.views[0].axes.iter().position(|a| a.kind.name() == "range").unwrap();
    assert_eq!(objective.regions()[0].bins[range], [0, problem.views[0].axes[range].bins]);
    assert!(objective.warnings()[0].contains("range"), "{:?}", objective.warnings());
}

#[test]
fn masks_lie_inside_the_region_and_hold_the_asked_share() {
    let case = case("mmvr-size");
    let problem = Arc::new(case.problem);
    let objective = Objective::new(Arc::clone(&problem), case.config, Precision::F64, &case.params).unwrap();
    let maps = simulate(&problem, &case.config, Precision::F64, &case.params);
    for (view, map) in maps.iter().enumerate() {
        let masks = masks(&objective, view, map);
        let inside = masks.inside.iter().filter(|&&x| x).count();
        assert_eq!(inside, objective.regions()[view].cells());
        for mask in [&masks.ori, &masks.sim] {
            assert!(mask.iter().zip(&masks.inside).all(|(m, inside)| *inside || !m));
            let share = mask.iter().filter(|&&x| x).count() as f64 / inside as f64;
            assert!((share - case.config.tau_pct / 100.0).abs() < 2.0 / inside as f64, "{share}");
        }
    }
}
