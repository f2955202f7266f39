#include "core/light/raycast.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "core/base/check.hpp"
#include "core/base/footprint.hpp"

namespace lichthof {

namespace {

static_assert(sizeof(RTCRay16) == sizeof(Segments16), "Segments16 is passed to the kernel as it is");

std::atomic<std::ptrdiff_t> device_bytes{0};  ///< allocated by Embree just now

/// One Embree device for the process: creating one costs milliseconds, and it holds no scene. It must not be told a number
/// of threads: Embree would limit oneTBB to that number in the whole process, Parallel's arenas included.
RTCDevice device() {
  struct Holder {
    RTCDevice handle = rtcNewDevice("set_affinity=0");
    Holder() {
      const auto count = [](void*, ssize_t bytes, bool) { return device_bytes += bytes, true; };
      rtcSetDeviceMemoryMonitorFunction(handle, count, nullptr);
    }
    ~Holder() { rtcReleaseDevice(handle); }
  };
  static const Holder holder;
  return holder.handle;
}

}  // namespace

struct RayScene::Impl {
  RTCScene scene = nullptr;
  Vec3 origin{0.0};
  double offset = 0;
  std::vector<std::uint32_t> surface_of_triangle;
  std::vector<Vec3> normals;
  std::size_t surface_count = 0;
  std::size_t kernel_bytes = 0;
  ~Impl() {
    if (scene) rtcReleaseScene(scene);
  }
};

RayScene::RayScene(const Scene& scene, std::span<const Surface> surfaces, const Vec3& origin, Glass glass)
    : impl_(std::make_unique<Impl>()) {
  impl_->origin = origin;
  impl_->surface_count = surfaces.size();
  impl_->normals.reserve(surfaces.size());

  // Triangles as fans; corners are shared exactly as in the input, so neighbouring surfaces stay watertight.
  std::vector<float> vertices;
  std::vector<std::uint32_t> indices;
  double largest = 0;
  for (std::uint32_t s = 0; s < surfaces.size(); ++s) {
    const Surface& surface = surfaces[s];
    impl_->normals.push_back(surface.normal);
    if (glass == Glass::clear && scene.material_of(surface).finish == Finish::glass) continue;
    const auto first = static_cast<std::uint32_t>(vertices.size() / 3);
    for (const Vec3& corner : surface.corners) {
      const Vec3 local = corner - origin;
      for (int axis = 0; axis < 3; ++axis) {
        vertices.push_back(static_cast<float>(local[axis]));
        largest = std::max(largest, std::abs(local[axis]));
      }
    }
    for (std::uint32_t k = 2; k < surface.corners.size(); ++k) {
      indices.insert(indices.end(), {first, first + k - 1, first + k});
      impl_->surface_of_triangle.push_back(s);
    }
  }
  impl_->offset = std::max(1e-6 * largest, 1e-30);

  const std::ptrdiff_t before = (device(), device_bytes.load());
  impl_->scene = rtcNewScene(device());
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_HIGH);
  if (!indices.empty()) {
    RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* v = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, vertices.size() / 3));
    std::copy(vertices.begin(), vertices.end(), v);
    auto* i = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, indices.size() / 3));
    std::copy(indices.begin(), indices.end(), i);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(impl_->scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(impl_->scene);
  impl_->kernel_bytes = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, device_bytes - before));
}

RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;

const Vec3& RayScene::origin() const { return impl_->origin; }
double RayScene::offset() const { return impl_->offset; }
std::size_t RayScene::surface_count() const { return impl_->surface_count; }
std::size_t RayScene::memory_bytes() const {
  return impl_->kernel_bytes + bytes_of_all(impl_->surface_of_triangle, impl_->normals);
}

void clear_segments(Segments16& segments) {
  for (int lane = 0; lane < 16; ++lane) {
    segments.ox[lane] = segments.oy[lane] = segments.oz[lane] = 0;
    segments.dx[lane] = segments.dy[lane] = segments.dz[lane] = 0;
    segments.tnear[lane] = segments.time[lane] = 0;
    segments.tfar[lane] = 1;
    segments.mask[lane] = ~0u;
    segments.id[lane] = segments.flags[lane] = 0;
  }
}

namespace {
LaneMask16 mask_of(std::uint32_t active) {
  LaneMask16 mask;
  for (int lane = 0; lane < 16; ++lane) mask.lane[lane] = (active >> lane) & 1 ? -1 : 0;
  return mask;
}
}  // namespace

std::uint32_t RayScene::occluded16(Segments16& segments, std::uint32_t active) const {
  const LaneMask16 lanes = mask_of(active);
  for (float& t : segments.tfar) t = 1.f;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded16(lanes.lane, impl_->scene, &context, reinterpret_cast<RTCRay16*>(&segments));
  std::uint32_t blocked = 0;
  for (int lane = 0; lane < 16; ++lane) blocked |= (segments.tfar[lane] < 0.f ? 1u : 0u) << lane;
  return blocked & active;
}

void RayScene::occluded16(Segments16& segments, const LaneMask16& active) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcOccluded16(active.lane, impl_->scene, &context, reinterpret_cast<RTCRay16*>(&segments));
}

bool RayScene::occluded(const Vec3& from, const Vec3& to) const {
  const Vec3 a = from - impl_->origin;
  const Vec3 d = to - from;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray{};
  ray.org_x = static_cast<float>(a.x), ray.org_y = static_cast<float>(a.y), ray.org_z = static_cast<float>(a.z);
  ray.dir_x = static_cast<float>(d.x), ray.dir_y = static_cast<float>(d.y), ray.dir_z = static_cast<float>(d.z);
  ray.tfar = 1.f;
  ray.mask = ~0u;
  rtcOccluded1(impl_->scene, &context, &ray);
  return ray.tfar < 0.f;
}

std::optional<Hit> RayScene::nearest(const Vec3& from, const Vec3& direction, double max_distance) const {
  const Vec3 a = from - impl_->origin;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query{};
  RTCRay& ray = query.ray;
  ray.org_x = static_cast<float>(a.x), ray.org_y = static_cast<float>(a.y), ray.org_z = static_cast<float>(a.z);
  ray.dir_x = static_cast<float>(direction.x), ray.dir_y = static_cast<float>(direction.y);
  ray.dir_z = static_cast<float>(direction.z);
  ray.tfar = static_cast<float>(max_distance);
  ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(impl_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const std::uint32_t surface = impl_->surface_of_triangle[query.hit.primID];
  return Hit{surface, ray.tfar, glm::dot(direction, impl_->normals[surface]) < 0};
}

void RayScene::nearest16(const Segments16& rays, std::uint32_t active, Hits16& hits) const {
  const LaneMask16 lanes = mask_of(active);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  alignas(64) RTCRayHit16 query;
  std::copy_n(reinterpret_cast<const char*>(&rays), sizeof(RTCRay16), reinterpret_cast<char*>(&query.ray));
  for (int lane = 0; lane < 16; ++lane) {
    query.ray.tfar[lane] = 1e30f;
    query.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }
  rtcIntersect16(lanes.lane, impl_->scene, &context, &query);
  hits.front_bits = 0;
  for (int lane = 0; lane < 16; ++lane) {
    hits.surface[lane] = no_surface;
    hits.distance[lane] = query.ray.tfar[lane];
    if (!((active >> lane) & 1) || query.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID) continue;
    const std::uint32_t surface = impl_->surface_of_triangle[query.hit.primID[lane]];
    const Vec3 direction{rays.dx[lane], rays.dy[lane], rays.dz[lane]};
    hits.surface[lane] = surface;
    hits.front_bits |= (glm::dot(direction, impl_->normals[surface]) < 0 ? 1u : 0u) << lane;
  }
}

// ---- Boxes ------------------------------------------------------------------------------------------------------------

struct SurfaceBoxes::Impl {
  explicit Impl(const Scene& scene_) : scene(scene_), origin(lichthof::bounds(scene_).centre()) {}
  ~Impl() { rtcReleaseScene(tree); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Box box_of(std::uint32_t surface) const {
    Box box;
    for (const Vec3& corner : scene.surfaces[surface].corners) box.include(corner);
    return box;
  }

  /// Embree's tree keeps single precision: a hair larger, so that it loses nothing.
  static void bounds(const RTCBoundsFunctionArguments* asked) {
    const auto& self = *static_cast<const Impl*>(asked->geometryUserPtr);
    const Box box = self.box_of(asked->primID);
    float* const bound[2][3] = {{&asked->bounds_o->lower_x, &asked->bounds_o->lower_y, &asked->bounds_o->lower_z},
                                {&asked->bounds_o->upper_x, &asked->bounds_o->upper_y, &asked->bounds_o->upper_z}};
    constexpr float most = std::numeric_limits<float>::max();
    for (int axis = 0; axis < 3; ++axis) {
      *bound[0][axis] = std::nextafter(static_cast<float>(box.lo[axis] - self.origin[axis]), -most);
      *bound[1][axis] = std::nextafter(static_cast<float>(box.hi[axis] - self.origin[axis]), most);
    }
  }

  struct Query {
    const Impl& self;
    const Box& box;
    std::vector<std::uint32_t> found;
  };
  static bool meet(RTCPointQueryFunctionArguments* at) {
    auto& query = *static_cast<Query*>(at->userPtr);
    const Box other = query.self.box_of(at->primID);
    bool is_apart = false;
    for (int axis = 0; axis < 3; ++axis)
      is_apart |= other.lo[axis] > query.box.hi[axis] || other.hi[axis] < query.box.lo[axis];
    if (!is_apart) query.found.push_back(at->primID);
    return false;  // the sphere stays as large as it is
  }

  const Scene& scene;
  Vec3 origin;
  RTCScene tree = rtcNewScene(device());
};

SurfaceBoxes::SurfaceBoxes(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {
  RTCGeometry geometry = rtcNewGeometry(device(), RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(scene.surfaces.size()));
  rtcSetGeometryUserData(geometry, impl_.get());
  rtcSetGeometryBoundsFunction(geometry, &Impl::bounds, nullptr);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(impl_->tree, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(impl_->tree);
}

SurfaceBoxes::~SurfaceBoxes() = default;

std::vector<std::uint32_t> SurfaceBoxes::near(const Box& box) const {
  Impl::Query query{*impl_, box, {}};
  const Vec3 centre = box.centre() - impl_->origin;
  RTCPointQuery sphere{};
  sphere.x = static_cast<float>(centre.x), sphere.y = static_cast<float>(centre.y);
  sphere.z = static_cast<float>(centre.z);
  // Rounding of the centre moves the sphere by less than this share of the coordinates.
  const double rounding = 1e-6 * (std::abs(centre.x) + std::abs(centre.y) + std::abs(centre.z));
  sphere.radius = static_cast<float>(0.5 * glm::length(box.size()) * (1 + 1e-6) + rounding);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(impl_->tree, &sphere, &context, &Impl::meet, &query);
  std::sort(query.found.begin(), query.found.end());
  return std::move(query.found);
}

}  // namespace lichthof
