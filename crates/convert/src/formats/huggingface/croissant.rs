//! Croissant's description: the rows, and the pictures that they name.
//!
//! Pictures are record sets of their own, a set for each column, whose paths lead to the rows:
//! programs read all files of a set at once, also for those who want rows alone. (mlcroissant makes
//! RGB of every PNG; where depth and class ids are, `path` tells.)

use serde_json::{Value, json};

use super::{MAPS, Part, data, metadata};
use crate::Source;

/// `croissant.json`. It has no URL, which is that of where somebody publishes the data set.
pub(super) fn describe(source: &Source, parts: &[Part]) -> Value {
    let mut distribution: Vec<_> = parts.iter().map(rows_file).collect();
    let mut record_sets = Vec::new();
    for part in parts {
        record_sets.push(rows(part));
        for column in kinds() {
            distribution.push(picture_files(part, column));
            record_sets.push(pictures(part, column));
        }
    }
    json!({
        "@context": context(),
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": "nemoral",
        "description": "Pictures of virtual forests, with exact classes, depth and normals.",
        "license": source.licence(),
        "version": "1.0.0",
        "creator": { "@type": "sc:Organization", "name": source.generator() },
        "distribution": distribution,
        "recordSet": record_sets,
    })
}

/// The kinds of pictures.
fn kinds() -> impl Iterator<Item = &'static str> {
    std::iter::once("image").chain(MAPS)
}

/// The name of a part's file of rows.
fn rows_name(part: &Part) -> String {
    metadata(part.split).replacen("data/", "", 1)
}

/// A part's file of rows.
fn rows_file(part: &Part) -> Value {
    json!({
        "@type": "cr:FileObject", "@id": rows_name(part), "name": rows_name(part),
        "contentUrl": metadata(part.split), "encodingFormat": "application/jsonlines",
        "sha256": part.digest,
    })
}

/// A part's rows: the record set `pictures`.
fn rows(part: &Part) -> Value {
    let name = part.of("pictures");
    let file = rows_name(part);
    let field = |column: &str, data_type: &str| {
        json!({
            "@type": "cr:Field", "@id": format!("{name}/{column}"), "name": column,
            "dataType": data_type,
            "source": { "fileObject": { "@id": file }, "extract": { "column": column } },
        })
    };
    let mut fields = Vec::new();
    for column in kinds() {
        fields.push(field(&path_column(column), "sc:Text"));
    }
    for (data_type, columns) in [
        ("sc:Text", &["camera", "lens"][..]),
        ("sc:Integer", &["sequence", "frame"][..]),
        ("sc:Float", &["time_s", "fx", "fy", "cx", "cy"][..]),
    ] {
        fields.extend(columns.iter().map(|column| field(column, data_type)));
    }
    for (column, description) in [
        ("distortion", "k1 k2 p1 p2 k3, or k1 to k4 of a fisheye"),
        ("world_from_camera", "three rows of four numbers"),
    ] {
        let mut list = field(column, "sc:Float");
        list["repeated"] = true.into();
        list["description"] = description.into();
        fields.push(list);
    }
    json!({ "@type": "cr:RecordSet", "@id": name, "name": name, "field": fields })
}

/// The column of rows that has the paths of a column of pictures.
fn path_column(column: &str) -> String {
    match column {
        "image" => "file_name".to_owned(),
        map => format!("{map}_file_name"),
    }
}

/// The name of the files of a column of pictures of a part.
fn files_name(part: &Part, column: &str) -> String {
    part.of(&format!("{column}-files"))
}

/// The files of a column of pictures of a part.
fn picture_files(part: &Part, column: &str) -> Value {
    let name = files_name(part, column);
    json!({
        "@type": "cr:FileSet", "@id": name, "name": name, "encodingFormat": "image/png",
        "includes": format!("{}/*/{column}/*.png", data(part.split)),
    })
}

/// A column of pictures of a part.
fn pictures(part: &Part, column: &str) -> Value {
    let (name, files) = (part.of(column), files_name(part, column));
    let row = format!("{}/{}", part.of("pictures"), path_column(column));
    // Rows name pictures from their own folder. mlcroissant takes the expression twice where it
    // joins, so that it takes its own result, too.
    let below = format!("^(?:{}/)?(.+)$", data(part.split));
    json!({
        "@type": "cr:RecordSet", "@id": name, "name": name,
        "field": [
            {
                "@type": "cr:Field", "@id": format!("{name}/path"), "name": "path",
                "dataType": "sc:Text",
                "source": {
                    "fileSet": { "@id": files }, "extract": { "fileProperty": "fullpath" },
                    "transform": { "regex": below },
                },
                "references": { "field": { "@id": row } },
            },
            {
                "@type": "cr:Field", "@id": format!("{name}/content"), "name": "content",
                "dataType": "sc:ImageObject",
                "source": {
                    "fileSet": { "@id": files }, "extract": { "fileProperty": "content" },
                },
            },
        ],
    })
}

/// The specification's own context, appendix 1.
fn context() -> Value {
    let plain = [
        "arrayShape",
        "citeAs",
        "column",
        "equivalentProperty",
        "extract",
        "field",
        "fileObject",
        "fileProperty",
        "fileSet",
        "format",
        "includes",
        "isArray",
        "isLiveDataset",
        "jsonPath",
        "key",
        "md5",
        "parentField",
        "path",
        "recordSet",
        "references",
        "regex",
        "repeated",
        "replace",
        "samplingRate",
        "separator",
        "source",
        "subField",
        "transform",
    ];
    let mut context = json!({
        "@language": "en", "@vocab": "https://schema.org/",
        "cr": "http://mlcommons.org/croissant/", "dct": "http://purl.org/dc/terms/",
        "rai": "http://mlcommons.org/croissant/RAI/", "sc": "https://schema.org/",
        "conformsTo": "dct:conformsTo",
        "data": { "@id": "cr:data", "@type": "@json" },
        "dataType": { "@id": "cr:dataType", "@type": "@vocab" },
        "examples": { "@id": "cr:examples", "@type": "@json" },
    });
    for name in plain {
        context[name] = format!("cr:{name}").into();
    }
    context
}
