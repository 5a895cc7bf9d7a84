//! A warm start: from the frame before.

use super::{perturb, shown};
use crate::body::{Group, Pppr};
use crate::config::{FitConfig, WarmStart};
use crate::geometry::{add, sub};
use crate::mhp::Problem;
use crate::mhp::context::{apart_m, centre};
use crate::mhp::region::centres;

/// Nobody in a room is faster, m/s: a farther jump is somebody else.
const FASTEST_MPS: f64 = 4.0;

/// A warm start: the persons of the frame before, moved as the maps of the two frames say that each of them moved, and
/// perturbed where the settings ask for it. Without that frame among those around, or with [`WarmStart::AsLeft`], they stay
/// where they are.
pub fn predict(problem: &Problem, config: &FitConfig, before: &Pppr) -> Pppr {
    let problem = problem.under(config);
    let mut params = before.clone();
    if config.warm_start == WarmStart::Moved {
        follow(problem, config, &mut params);
    }
    perturb::perturb(problem, &config.init, &mut params);
    params
}

/// Moves the persons of the frame before as the maps of the two frames say.
fn follow(problem: &Problem, config: &FitConfig, params: &mut Pppr) {
    let context = problem.context(config);
    let Some((t_s, then)) = context.around().rev().find(|(t_s, _)| *t_s < 0.0) else { return };
    let ((now, _), then) = (shown(problem, config), then());
    let now = now.as_ref();
    let joints = params.shape().joints;
    let places = centres(params);
    for (person, &at) in places.iter().enumerate() {
        let apart_m = apart_m(&places, person);
        let (from, _) = centre(&problem.views, then, at, apart_m);
        let way = sub(centre(&problem.views, now, from, apart_m).0, from);
        let far = way[0].hypot(way[1]) > FASTEST_MPS * -t_s;
        if far || !way.iter().all(|x| x.is_finite()) {
            continue;
        }
        for joint in person * joints..(person + 1) * joints {
            // Heights are read too coarsely to follow them from frame to frame.
            let moved = add(params.position(joint), [way[0], way[1], 0.0]);
            params.set_vec3(Group::Position, joint, moved);
        }
    }
}
