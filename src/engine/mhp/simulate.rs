//! H_sim over whole maps; SPEC section 3.

use super::cell_box::CellBox;
use super::floors::floored;
use super::frame_em::{forward_config, skin_of};
use super::gaussian::WorldGaussians;
use super::kernel::Kernel;
use super::region::Region;
use super::scalar::Real;
use super::splat::{Splats, ViewModel};
use super::tiles::Tiles;
use super::{Precision, Problem};
use crate::body::Pppr;
use crate::config::{FitConfig, Summation};
use crate::radar::View;

/// H_sim of every view over its whole map, C order, f64; SPEC section 3.
pub fn simulate(problem: &Problem, config: &FitConfig, precision: Precision, params: &Pppr) -> Vec<Vec<f64>> {
    let problem = problem.under(config);
    let mut gaussians = WorldGaussians::default();
    let skin = skin_of(config, (&problem.views, &problem.skeleton, &problem.radar)).map(|mut skin| {
        skin.fill(params, precision);
        skin
    });
    let config = &forward_config(config, skin.is_some());
    let params = skin.as_ref().map_or(params, |skin| &skin.points);
    gaussians.fill(params, skin.is_some(), precision);
    let (mut splats, mut scratch) = (Splats::default(), Splats::default());
    let of_view = |view: &View| {
        let region = Region::whole(view);
        let cell_box = CellBox::new(view, &region.bins, (&vec![false; region.cells()], None), precision);
        let model = ViewModel::new(&problem.radar, &cell_box.view, config);
        model.splats_of(&model.lobes(), (params, &gaussians), precision, (&mut splats, &mut scratch));
        let map = match precision {
            Precision::F64 => map::<f64>(&splats, &cell_box, config.summation),
            Precision::F32 => {
                let tiled = Tiles::default().map(&splats, &cell_box.grid, config.summation);
                tiled.unwrap_or_else(|| map::<f32>(&splats, &cell_box, config.summation))
            }
        };
        cell_box.in_order_of_view(map)
    };
    problem.views.iter().map(of_view).collect()
}

fn map<T: Real>(splats: &Splats, cell_box: &CellBox, summation: Summation) -> Vec<f64> {
    let mut map = vec![f64::NEG_INFINITY; cell_box.marked.len()];
    Kernel::<T>::new(splats, &cell_box.bins, summation).forward(&mut map);
    for value in &mut map {
        *value = floored(*value);
    }
    map
}
