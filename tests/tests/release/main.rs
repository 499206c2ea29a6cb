//! What is shipped is whole: documents, licences, the layers of crates, and recorded data sets.

mod docs;
mod files;
mod graph;
mod licences;
mod manual;
