//! Small pieces that several panes use.

mod chip;
mod colorbar;
mod setting;
mod work;

pub(super) use chip::{Named, chip, icon_button, iou_color, value_row};
pub(super) use colorbar::{ColorBar, colorbar, tick};
pub(super) use setting::{rows, settings};
pub(super) use work::{WorkAsked, work};
