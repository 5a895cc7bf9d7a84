//! Small pieces that several panes use.

mod chip;
mod colorbar;
mod limits;
mod setting;
mod work;

pub(super) use chip::{Named, chip, grounded, icon_button, iou_color, value_row};
pub(super) use colorbar::{BarRow, ColorBar, colorbar, round_step, tick};
pub(super) use limits::LimitsEdit;
pub(super) use setting::{rows, settings};
pub(super) use work::{WorkAsked, work};
