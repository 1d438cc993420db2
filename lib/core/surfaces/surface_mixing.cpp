#include "xplane_bridge/core/surfaces/surface_mixing.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>

#include "xplane_bridge/core/base/text.hpp"

namespace xplane_bridge::core {
namespace {

constexpr std::array<const char*, kMixingTerms> kTermNames = {
    "bias",      "roll+",      "roll-",    "pitch+", "pitch-",     "yaw+", "yaw-",
    "trim_roll", "trim_pitch", "trim_yaw", "flap1",  "speedbrake", "flap2"};

struct AxisHalf {
  MixingTerm term;
  const char* advice;
};
constexpr AxisHalf kAxisHalves[] = {
    {MixingTerm::kRollPlus, "roll right"},     {MixingTerm::kRollMinus, "roll left"},
    {MixingTerm::kPitchPlus, "pitch nose up"}, {MixingTerm::kPitchMinus, "pitch nose down"},
    {MixingTerm::kYawPlus, "yaw right"},       {MixingTerm::kYawMinus, "yaw left"},
};

// Which terms can be separated, by elimination in the order of MixingTerm.
struct Elimination {
  std::vector<int> terms;    // kept
  MixingVector independent;  // rms movement of each term that the kept ones before it do not explain
};

Elimination eliminate(const MixingMatrix& xx, std::size_t samples, double independence) {
  Elimination out;
  out.independent = MixingVector::Zero();
  for (int j = 0; j < static_cast<int>(kMixingTerms); ++j) {
    double rest = xx(j, j);
    if (!out.terms.empty()) {
      const auto k = static_cast<Eigen::Index>(out.terms.size());
      Eigen::MatrixXd kept(k, k);
      Eigen::VectorXd cross(k);
      for (Eigen::Index a = 0; a < k; ++a) {
        for (Eigen::Index b = 0; b < k; ++b) {
          kept(a, b) = xx(out.terms[static_cast<std::size_t>(a)], out.terms[static_cast<std::size_t>(b)]);
        }
        cross[a] = xx(out.terms[static_cast<std::size_t>(a)], j);
      }
      rest -= cross.dot(kept.ldlt().solve(cross));
    }
    out.independent[j] = std::sqrt(std::max(0.0, rest) / static_cast<double>(samples));
    if (out.independent[j] >= independence) out.terms.push_back(j);
  }
  return out;
}

std::string rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

}  // namespace

const char* toString(MixingTerm term) { return kTermNames[static_cast<std::size_t>(term)]; }

MixingVector mixingTerms(const MixingInputs& in) {
  MixingVector x;
  x << 1.0, std::max(in.roll, 0.0), std::min(in.roll, 0.0), std::max(in.pitch, 0.0), std::min(in.pitch, 0.0),
      std::max(in.yaw, 0.0), std::min(in.yaw, 0.0), in.trim_roll, in.trim_pitch, in.trim_yaw, in.flap1, in.speedbrake,
      in.flap2;
  return x;
}

const std::array<const char*, 9>& mixingInputDatarefs() {
  static constexpr std::array<const char*, 9> kDatarefs = {
      "sim/cockpit2/controls/total_roll_ratio",       "sim/cockpit2/controls/total_pitch_ratio",
      "sim/cockpit2/controls/total_heading_ratio",    "sim/cockpit2/controls/aileron_trim",
      "sim/cockpit2/controls/elevator_trim",          "sim/cockpit2/controls/rudder_trim",
      "sim/flightmodel2/controls/flap1_deploy_ratio", "sim/flightmodel2/controls/flap2_deploy_ratio",
      "sim/flightmodel2/controls/speedbrake_ratio"};
  return kDatarefs;
}

MixingInputs mixingInputsFrom(const std::array<double, 9>& v) {
  return {v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8]};
}

const SurfaceLaw* MixingModel::lawOf(std::size_t surface) const {
  const auto it = std::find_if(laws.begin(), laws.end(), [&](const SurfaceLaw& law) { return law.surface == surface; });
  return it == laws.end() ? nullptr : &*it;
}

std::vector<std::string> MixingModel::unknownMovement(const MixingInputs& inputs, double tolerance) const {
  const MixingVector x = mixingTerms(inputs);
  std::vector<std::string> out;
  for (std::size_t j = 0; j < kMixingTerms; ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    if (!known[j] && std::abs(x[i] - level[i]) > tolerance) out.emplace_back(kTermNames[j]);
  }
  return out;
}

std::string MixingQuality::text() const { return good ? "good" : join(needs, "; "); }

MixingIdentifier::MixingIdentifier(MixingRequirements requirements)
    : requirements_(requirements), surfaces_(surfaceTable().size()) {}

void MixingIdentifier::reset() { *this = MixingIdentifier(requirements_); }

bool MixingIdentifier::addSample(const MixingInputs& inputs, const std::vector<double>& deflections_deg) {
  const MixingVector x = mixingTerms(inputs);
  if (!x.allFinite() || deflections_deg.size() != surfaces_.size()) return false;
  xx_ += x * x.transpose();
  reach_ = reach_.cwiseMax(x.cwiseAbs());
  ++samples_;
  for (std::size_t i = 0; i < surfaces_.size(); ++i) {
    const double y = deflections_deg[i];
    if (!std::isfinite(y)) continue;
    SurfaceSums& sums = surfaces_[i];
    sums.xy += y * x;
    sums.yy += y * y;
    sums.low = sums.count == 0 ? y : std::min(sums.low, y);
    sums.high = sums.count == 0 ? y : std::max(sums.high, y);
    ++sums.count;
  }
  return true;
}

MixingIdentifier::Solution MixingIdentifier::solve(const std::string& aircraft) const {
  Solution out;
  out.model.aircraft = aircraft;
  out.model.samples = samples_;
  MixingQuality& quality = out.quality;
  if (samples_ < requirements_.samples) {
    quality.needs.push_back("more time: " + std::to_string(samples_) + " samples of normal flight, need " +
                            std::to_string(requirements_.samples));
  }
  if (samples_ == 0) return out;

  const double n = static_cast<double>(samples_);
  const Elimination kept = eliminate(xx_, samples_, requirements_.independence);
  out.model.level = xx_.row(0).transpose() / n;  // means, because the first term is always 1
  for (const int j : kept.terms) out.model.known[static_cast<std::size_t>(j)] = true;
  for (const AxisHalf& half : kAxisHalves) {
    const auto j = static_cast<Eigen::Index>(half.term);
    if (reach_[j] < requirements_.excursion) {
      quality.needs.push_back(std::string(half.advice) + ": seen up to " + rounded(reach_[j]) + ", need " +
                              rounded(requirements_.excursion) + " of full stick");
    } else if (!out.model.known[static_cast<std::size_t>(j)]) {
      quality.needs.push_back(std::string(half.advice) + ": moved alone by " + rounded(kept.independent[j]) +
                              " rms, need " + rounded(requirements_.independence) +
                              "; move it independently of the other axes");
    }
  }

  const auto k = static_cast<Eigen::Index>(kept.terms.size());
  Eigen::MatrixXd xx(k, k);
  for (Eigen::Index a = 0; a < k; ++a) {
    for (Eigen::Index b = 0; b < k; ++b) {
      xx(a, b) = xx_(kept.terms[static_cast<std::size_t>(a)], kept.terms[static_cast<std::size_t>(b)]);
    }
  }
  const Eigen::MatrixXd inverse = xx.ldlt().solve(Eigen::MatrixXd::Identity(k, k));
  for (std::size_t s = 0; s < surfaces_.size(); ++s) {
    const SurfaceSums& sums = surfaces_[s];
    // A surface known in some samples only cannot be solved with the sums of all.
    if (sums.count != samples_ || sums.high - sums.low < requirements_.moving_deg) continue;
    Eigen::VectorXd xy(k);
    for (Eigen::Index a = 0; a < k; ++a) xy[a] = sums.xy[kept.terms[static_cast<std::size_t>(a)]];
    const Eigen::VectorXd slopes = inverse * xy;
    SurfaceLaw law;
    law.surface = s;
    law.low_deg = sums.low;
    law.high_deg = sums.high;
    law.residual_deg = std::sqrt(std::max(0.0, sums.yy - slopes.dot(xy)) / n);
    for (Eigen::Index a = 0; a < k; ++a) {
      const int term = kept.terms[static_cast<std::size_t>(a)];
      law.slopes[term] = slopes[a];
      const double error = law.residual_deg * std::sqrt(inverse(a, a));
      if (error > requirements_.slope_error_deg) {
        quality.needs.push_back(surfaceTable()[s].name + " to " + kTermNames[static_cast<std::size_t>(term)] +
                                ": its answer is known to " + rounded(error) + " deg only, need " +
                                rounded(requirements_.slope_error_deg));
      }
    }
    for (const AxisHalf& half : kAxisHalves) {
      MixingVector full = MixingVector::Zero();
      full[0] = 1.0;
      const auto j = static_cast<Eigen::Index>(half.term);
      full[j] = j % 2 == 1 ? 1.0 : -1.0;  // plus and minus alternate, plus first
      law.low_deg = std::min(law.low_deg, law.deflection(full));
      law.high_deg = std::max(law.high_deg, law.deflection(full));
    }
    // Flaps and brakes that were moved a little can go all the way.
    for (const MixingTerm handle : {MixingTerm::kFlap1, MixingTerm::kSpeedbrake, MixingTerm::kFlap2}) {
      const auto j = static_cast<Eigen::Index>(handle);
      law.low_deg = std::min(law.low_deg, law.slopes[0] + law.slopes[j]);
      law.high_deg = std::max(law.high_deg, law.slopes[0] + law.slopes[j]);
    }
    if (law.residual_deg > quality.worst_residual_deg) {
      quality.worst_residual_deg = law.residual_deg;
      quality.worst_surface = surfaceTable()[s].name;
    }
    out.model.laws.push_back(law);
  }
  if (quality.worst_residual_deg > requirements_.residual_deg) {
    quality.needs.push_back(quality.worst_surface +
                            " does not follow stick, trims and flaps: " + rounded(quality.worst_residual_deg) +
                            " deg rms remain, need " + rounded(requirements_.residual_deg));
  }
  if (out.model.laws.empty()) quality.needs.emplace_back("no surface has moved");
  quality.good = quality.needs.empty();
  return out;
}

std::string mixingPath(const std::string& folder, const std::string& aircraft) {
  std::string name = aircraft;
  for (char& c : name) {
    const auto u = static_cast<unsigned char>(c);
    if (!std::isalnum(u) && c != '.' && c != '_' && c != '-') c = '-';
  }
  return folder + "/" + name + ".yaml";
}

}  // namespace xplane_bridge::core
