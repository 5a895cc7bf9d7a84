//! What a researcher does with the window from the first minute on: ten tasks of a newcomer, each by mouse and each by
//! keyboard, and the way from the hard frames to the labels at home.

mod hard_frames;
mod newcomer;
