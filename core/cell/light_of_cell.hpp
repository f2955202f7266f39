/// What the cell machine asks of the light it keeps. The machine is all protocol; the physics stands behind these calls,
/// so that the protocol can be tested with light that is exact and cheap.
#pragma once

#include <memory>

#include "core/light/cell_light.hpp"

namespace lichthof {

/// Each call means what the function of the same name means in CellLight; see there for units and contracts.
class LightOfCell {
 public:
  virtual ~LightOfCell() = default;
  virtual CellLight::Candidate strongest() const = 0;
  virtual double largest_initial_power() const = 0;
  virtual Shot take_shot(GroupId group, ShotId id, SceneVersion version) = 0;
  virtual TransferWork receive(const Shot& shot, const HemicubeBitmap* incoming) = 0;
  virtual std::vector<Passage> project(const Shot& shot, std::span<const NextCell> next,
                                       const HemicubeBitmap& bitmap) const = 0;
  virtual void set_emission(std::uint32_t material, const Rgb& radiance) = 0;
  virtual void set_reflectance(std::uint32_t material, const Rgb& reflectance) = 0;
  virtual CellPower power() const = 0;
  virtual std::size_t memory_bytes() const { return 0; }
};

/// The real light behind the interface. The machine owns the interface, the caller keeps the light: whoever stores the
/// solution needs it after the run.
class RealLight final : public LightOfCell {
 public:
  explicit RealLight(std::shared_ptr<CellLight> light) : light_(std::move(light)) {}
  CellLight::Candidate strongest() const override { return light_->strongest(); }
  double largest_initial_power() const override { return light_->largest_initial_power(); }
  Shot take_shot(GroupId group, ShotId id, SceneVersion version) override {
    return light_->take_shot(group, id, version);
  }
  TransferWork receive(const Shot& shot, const HemicubeBitmap* incoming) override {
    return light_->receive(shot, incoming);
  }
  std::vector<Passage> project(const Shot& shot, std::span<const NextCell> next,
                               const HemicubeBitmap& bitmap) const override {
    return light_->project(shot, next, bitmap);
  }
  void set_emission(std::uint32_t material, const Rgb& radiance) override { light_->set_emission(material, radiance); }
  void set_reflectance(std::uint32_t material, const Rgb& reflectance) override {
    light_->set_reflectance(material, reflectance);
  }
  CellPower power() const override { return light_->power(); }
  std::size_t memory_bytes() const override { return light_->memory_bytes(); }

 private:
  std::shared_ptr<CellLight> light_;
};

}  // namespace lichthof
