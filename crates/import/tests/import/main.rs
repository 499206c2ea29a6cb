//! Tests of what is read of files of users; `hostile` counts memory and is a program of its own.

#[path = "../common/mod.rs"]
mod common;

mod height_maps;
mod logs;
mod models;
