//! Materials: preview surfaces with their pictures.

use std::collections::BTreeMap;

use nemoral_scene::{Material, MaterialId};

use super::text::{Text, quoted};
use crate::name::{self, Names};
use crate::picture::Pictures;
use crate::scene::ExportScene;

/// The materials that shapes use, by their names.
pub(super) struct Materials<'a> {
    scene: &'a ExportScene,
    names: BTreeMap<MaterialId, String>,
    known: Names,
}

impl<'a> Materials<'a> {
    pub(super) fn new(scene: &'a ExportScene) -> Self {
        Self {
            scene,
            names: BTreeMap::new(),
            known: Names::default(),
        }
    }

    /// The name of a material's prim.
    pub(super) fn name(&mut self, material: MaterialId) -> String {
        let known = &mut self.known;
        let of = |id| name::plain(&self.scene.materials.get(id).name);
        let named = self.names.entry(material);
        named.or_insert_with(|| known.unique(of(material))).clone()
    }

    /// Writes all of them, and returns their pictures with the names of their files.
    pub(super) fn write(self, text: &mut Text) -> Vec<(String, Vec<u8>)> {
        let mut pictures = Pictures::default();
        let mut files = Vec::new();
        text.open("def Scope \"Materials\"");
        for (&id, name) in &self.names {
            let material = self.scene.materials.get(id);
            let number = pictures.number(material);
            if number == files.len() {
                // A picture has the name of the first material that uses it.
                files.push(format!("textures/{name}.png"));
            }
            let class = &self.scene.ontology.class(material.semantic).name;
            write_material(text, (name, material), class, &files[number]);
        }
        text.close();
        let contents = pictures.files().into_iter().map(|(content, _)| content);
        files.into_iter().zip(contents).collect()
    }
}

fn write_material(
    text: &mut Text,
    (name, material): (&str, &Material),
    class: &str,
    picture: &str,
) {
    let path = format!("/Forest/Materials/{name}");
    text.open(&format!("def Material {}", quoted(name)));
    let semantic = material.semantic.name();
    let [r, g, b] = material.transmittance.to_array();
    text.line(&format!("custom string nemoral:semantic = \"{semantic}\""));
    text.line(&format!("custom string nemoral:class = {}", quoted(class)));
    text.line(&format!(
        "custom color3f nemoral:transmittance = ({r}, {g}, {b})"
    ));
    for (wavelength, band) in [
        ("905", material.optics.nm905),
        ("1550", material.optics.nm1550),
    ] {
        text.line(&format!(
            "custom float2 nemoral:laser_{wavelength}_nm = ({}, {})",
            band.reflectance, band.transmittance
        ));
    }
    text.line(&format!(
        "token outputs:surface.connect = <{path}/Surface.outputs:surface>"
    ));
    text.open("def Shader \"Surface\"");
    text.line("uniform token info:id = \"UsdPreviewSurface\"");
    text.line(&format!(
        "color3f inputs:diffuseColor.connect = <{path}/Picture.outputs:rgb>"
    ));
    text.line(&format!("float inputs:roughness = {}", material.roughness));
    text.line("float inputs:metallic = 0");
    if material.mask.is_some() {
        text.line(&format!(
            "float inputs:opacity.connect = <{path}/Picture.outputs:a>"
        ));
        text.line("float inputs:opacityThreshold = 0.5");
    }
    text.line("token outputs:surface");
    text.close();
    text.open("def Shader \"Picture\"");
    text.line("uniform token info:id = \"UsdUVTexture\"");
    text.line(&format!("asset inputs:file = @./{picture}@"));
    text.line("token inputs:sourceColorSpace = \"sRGB\"");
    let wrap = if material.mask.is_some() {
        "clamp"
    } else {
        "repeat"
    };
    text.line(&format!("token inputs:wrapS = \"{wrap}\""));
    text.line(&format!("token inputs:wrapT = \"{wrap}\""));
    text.line(&format!(
        "float2 inputs:st.connect = <{path}/Coordinates.outputs:result>"
    ));
    text.line("float3 outputs:rgb");
    if material.mask.is_some() {
        text.line("float outputs:a");
    }
    text.close();
    text.open("def Shader \"Coordinates\"");
    text.line("uniform token info:id = \"UsdPrimvarReader_float2\"");
    text.line("string inputs:varname = \"st\"");
    text.line("float2 outputs:result");
    text.close();
    text.close();
}
