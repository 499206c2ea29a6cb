//! Tests of terrain, in one program.

mod mesh;
mod relief;
mod terrain;
