/// Sensor points: a CSV in, the same rows with results appended out.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/base/expected.hpp"
#include "core/base/types.hpp"
#include "core/scene/scene.hpp"
#include "core/tracing/path_tracer.hpp"

namespace lichthof::io {

struct SensorPoints {
  std::string header;             ///< as written, without line end
  std::vector<std::string> rows;  ///< as written; blank lines are left out
  std::vector<Vec3> positions;    ///< m, z up; one per row
  std::vector<Vec3> normals;      ///< unit
};

/// Reads the header line, which names the columns x, y, z, nx, ny, nz in any order among others, and the rows.
/// @param frame  unit and up axis of the file's numbers: those of the scene
/// @error bad_input with file:line: no header, a missing column, a row with fewer cells, a cell that is no finite number, a
///        normal of length zero
Expected<SensorPoints> read_points(const std::string& path, const FileFrame& frame);

/// Writes header and rows as they were read, with `Er,Eg,Eb` appended (W/m², %.9g).
/// @param irradiance  one per row
/// @error io; nothing half-written stays behind
Status write_irradiance(const std::string& path, const SensorPoints& points, std::span<const Rgb> irradiance);

/// The same with one column `lux`: 179 lm/W on the CIE Y of the irradiance.
Status write_illuminance(const std::string& path, const SensorPoints& points, std::span<const Rgb> irradiance);

/// Irradiance at points, with standard errors, as `bench error --reference` keeps it.
struct PointEstimates {
  std::vector<SensorPoint> points;
  std::vector<Estimate> irradiance;  ///< one per point, W/m²
};

/// Reads points and, in columns Er, Eg, Eb, the irradiance there: what write_irradiance() and write_estimates() leave. Standard
/// errors stand in Sr, Sg, Sb; without these columns they are 0.
/// @error bad_input as above; there are no rows; irradiance that is no finite number ≥ 0
Expected<PointEstimates> read_estimates(const std::string& path, const FileFrame& frame);

/// Writes the columns x,y,z,nx,ny,nz,Er,Eg,Eb,Sr,Sg,Sb (%.9g). @error io; nothing half-written stays behind
Status write_estimates(const std::string& path, const PointEstimates& estimates, const FileFrame& frame);

}  // namespace lichthof::io
