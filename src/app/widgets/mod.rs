//! Small pieces that several panes use.

mod chip;
mod colorbar;
mod icon;
mod limits;
mod setting;
mod work;

pub(super) use chip::{Named, chip, fitting, grounded, icon_button, iou_color, value_row};
pub(super) use colorbar::{BarRow, ColorBar, colorbar, round_step, tick};
#[cfg(test)]
pub(super) use icon::extent as icon_extent;
pub(super) use icon::{Icon, Mark, draw as draw_icon};
pub(super) use limits::LimitsEdit;
pub(super) use setting::{rows, settings};
pub(super) use work::{WorkAsked, work};
