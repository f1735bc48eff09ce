#include "core/detect/places.h"

#include <gtest/gtest.h>

namespace binpose {
namespace {

constexpr float kFar = 10;

/// A model 1 m across, in a pose turned about its centre.
struct Places {
  Model model;
  Places() {
    model.diameter = 1;
    model.centre = {0.1, 0.2, 0.3};
  }
  Candidate at(float x, float degrees = 0) const {
    Candidate candidate;
    candidate.T_view_model = Eigen::Translation3f(x, 0, 2) *
                             Eigen::AngleAxisf(degrees * static_cast<float>(kDegree), Eigen::Vector3f::UnitZ()) *
                             Eigen::Translation3f(-model.centre.cast<float>());
    return candidate;
  }
};

TEST(Places, KeepTheFirstOfThoseThatCompete) {
  const Places places;
  const std::vector<Candidate> kept =
      first_of_each_place({places.at(0), places.at(0.2F), places.at(0.24F), places.at(kFar), places.at(kFar + 0.3F)},
                          places.model, 2, 100, 0);
  ASSERT_EQ(kept.size(), 4U);
  EXPECT_NEAR((kept[1].T_view_model * places.model.centre.cast<float>()).x(), 0.2F, 1e-5);
  EXPECT_NEAR((kept[2].T_view_model * places.model.centre.cast<float>()).x(), kFar, 1e-5);
}

TEST(Places, DropWhatRepeatsAnEarlierOneTurnedAlike) {
  const Places places;
  const std::vector<Candidate> candidates = {places.at(0), places.at(0.01F, 3), places.at(0.01F, 30)};
  EXPECT_EQ(first_of_each_place(candidates, places.model, 10, 100, 0.02F).size(), 2U);
  EXPECT_EQ(first_of_each_place(candidates, places.model, 10, 100, 0.005F).size(), 3U);
}

TEST(Places, DropWhatASymmetryOfTheModelMapsOntoAnEarlierOne) {
  Places places;
  const std::vector<Candidate> candidates = {places.at(0), places.at(0.01F, 178), places.at(0.01F, 90)};
  EXPECT_EQ(first_of_each_place(candidates, places.model, 10, 100, 0.02F).size(), 3U);
  places.model.symmetry.discrete.push_back(
      turn_about(places.model.centre, Eigen::AngleAxisd(180 * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix()));
  EXPECT_EQ(first_of_each_place(candidates, places.model, 10, 100, 0.02F).size(), 2U);
  places.model.symmetry.has_axis = true;
  EXPECT_EQ(first_of_each_place(candidates, places.model, 10, 100, 0.02F).size(), 1U);
}

TEST(Places, KeepNoMoreThanAskedFor) {
  const Places places;
  EXPECT_EQ(first_of_each_place({places.at(0), places.at(1), places.at(2)}, places.model, 10, 2, 0).size(), 2U);
  EXPECT_TRUE(first_of_each_place({}, places.model, 10, 2, 0).empty());
}

}  // namespace
}  // namespace binpose
