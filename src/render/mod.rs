//! Pictures drawn by wgpu and their CPU twins; knows no window and no session.
