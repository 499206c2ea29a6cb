//! The geometry of a chunk's ground and objects, ready for rays.

use std::sync::Arc;

use nemoral_raycast::{Blas, Group};
use nemoral_scene::glam::{DVec2, Mat3, Vec3};
use nemoral_scene::{ChunkCoord, Instance, ObjectId, Prototype};
use nemoral_seed::{Domain, Key};
use nemoral_stand::{FLOOR_FIELD, FloorComposition, SceneObjects};
use nemoral_terrain::{GroundMesher, MeshParams};

use crate::config::Config;
use crate::plan::{Encode, Encoder, Hasher, Node, OfWorld, Stage};
use crate::world::assets::WorldAssets;
use crate::world::ground::{ChunkGround, TerrainField, ground_material};
use crate::{Error, InputFiles};

const FLOOR: Domain = Domain::new("pipeline.floor");

/// The ground of a chunk and all its objects: what has an id, and what it stands on.
#[derive(Debug)]
pub struct ObjectGeometry(pub Arc<Group>);

/// Meshes the ground of a chunk and stands its objects on it.
#[derive(Clone, Debug)]
pub struct ObjectGeometryStage {
    mesher: GroundMesher,
    params: MeshParams,
    /// Of what covers the ground, in the order of the library's floors.
    floor: [f64; 3],
    chunk_size_m: f64,
}

impl ObjectGeometryStage {
    /// The stage of a config.
    ///
    /// # Errors
    /// If the cells do not fit the chunk.
    pub fn new(config: &Config) -> Result<Self, Error> {
        let params = MeshParams {
            chunk_size_m: config.chunks.size_m,
            cell_m: config.terrain.cell_m,
            fine_cell_m: config.terrain.fine_cell_m,
            ..MeshParams::default()
        };
        let mesher =
            GroundMesher::new(params).map_err(|e| Error::request(format!("terrain: {e}")))?;
        Ok(Self {
            mesher,
            params,
            floor: {
                let floor = &config.undergrowth.floor;
                [floor.leaf_litter, floor.needle_litter, floor.moss]
            },
            chunk_size_m: config.chunks.size_m,
        })
    }
}

impl Encode for ObjectGeometryStage {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            // Made of the parameters.
            mesher: _,
            params,
            floor,
            // One of the parameters.
            chunk_size_m: _,
        } = self;
        let MeshParams {
            chunk_size_m,
            cell_m,
            fine_cell_m,
            tolerance_m,
        } = params;
        encoder.field("chunk_size_m", chunk_size_m);
        encoder.field("cell_m", cell_m);
        encoder.field("fine_cell_m", fine_cell_m);
        encoder.field("tolerance_m", tolerance_m);
        encoder.field("floor", floor);
    }
}

impl Stage for ObjectGeometryStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, SceneObjects>,
    );
    type Output = ObjectGeometry;
    const ID: &'static str = "chunk.solid";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, self);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, ground, objects): (Arc<WorldAssets>, Arc<ChunkGround>, Arc<SceneObjects>),
    ) -> Result<ObjectGeometry, Error> {
        let library = &assets.library;
        let floor = FloorComposition::new(
            self.floor,
            TerrainField::new(FLOOR_FIELD, world.domain(FLOOR))?,
        );
        let material =
            |p: DVec2, inside: bool| ground_material(&library.ground, &floor, &ground, p, inside);
        let mesh = self.mesher.mesh(at, &*ground, &*ground, &material);
        let prototype = Prototype::new("ground", mesh, Vec::new(), &library.materials)
            .map_err(Error::of_stage)?;
        let blas = Arc::new(Blas::build(Arc::new(prototype), &library.materials));
        let mut instances = vec![(
            Instance {
                prototype: Arc::clone(blas.prototype()),
                position_m: Vec3::ZERO,
                linear: Mat3::IDENTITY,
                object: ObjectId::NONE,
                variation: 0.5,
            },
            blas,
        )];
        let placed = |object| assets.instance(object, at, self.chunk_size_m);
        instances.extend(objects.0.iter().map(placed));
        Ok(ObjectGeometry(Arc::new(Group::build(instances))))
    }
}
