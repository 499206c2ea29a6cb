//! Forest trails across an endless chunked world: routes, sections, carving, surfaces and trail-side vegetation.
