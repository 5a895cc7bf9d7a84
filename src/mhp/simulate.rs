//! H_sim over whole maps; SPEC section 3.

use super::floors::floored;
use super::form::Forms;
use super::kernel::Kernel;
use super::laid::Laid;
use super::region::Region;
use super::scalar::Real;
use super::splat::{Scene, Splats};
use super::tiles::Tiles;
use super::{Precision, Problem};
use crate::body::Pppr;
use crate::config::{FitConfig, Summation};
use crate::radar::View;

/// H_sim of every view over its whole map, C order, f64; SPEC section 3.
pub fn simulate(problem: &Problem, config: &FitConfig, precision: Precision, params: &Pppr) -> Vec<Vec<f64>> {
    let mut forms = Forms::default();
    forms.fill(params, precision);
    let mut splats = Splats::default();
    let of_view = |view: &View| {
        let region = Region::whole(view);
        let laid = Laid::new(view, &region.bins, &vec![false; region.cells()], precision);
        Scene::new(&problem.radar, &laid.view, config).splats((params, &forms), precision, &mut splats);
        let map = match precision {
            Precision::F64 => map::<f64>(&splats, &laid, config.summation),
            Precision::F32 => {
                let tiled = Tiles::default().map(&splats, &laid.tiling, config.summation);
                tiled.unwrap_or_else(|| map::<f32>(&splats, &laid, config.summation))
            }
        };
        laid.in_order_of_view(map)
    };
    problem.views.iter().map(of_view).collect()
}

fn map<T: Real>(splats: &Splats, laid: &Laid, summation: Summation) -> Vec<f64> {
    let mut map = vec![f64::NEG_INFINITY; laid.marked.len()];
    Kernel::<T>::new(splats, &laid.bins, summation).forward(&mut map);
    for value in &mut map {
        *value = floored(*value);
    }
    map
}
