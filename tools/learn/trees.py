"""Trees of three questions for what the curves of model.py leave, by xgboost, in the firmware's numbers."""

import dataclasses
import json

import numpy
import xgboost

import model

OPTIONS = {"objective": "binary:logistic", "tree_method": "hist", "max_bin": 256, "max_depth": 3, "eta": 0.4,
           "subsample": 0.7, "colsample_bynode": 0.6, "lambda": 50.0, "min_child_weight": 10.0, "nthread": 1, "seed": 4}


def fill_tree(node, at, kind, limit, leaf):
    """From question at on; a leaf that comes early is the answer to both sides of questions that ask nothing."""
    if at >= model.QUESTIONS:
        leaf[at - model.QUESTIONS] = int(numpy.clip(round(node["leaf"] * 256), -128, 127))
        return
    below = {child["nodeid"]: child for child in node.get("children", [])}
    if below:
        kind[at], limit[at] = int(node["split"][1:]), int(numpy.ceil(node["split_condition"]))
    fill_tree(below[node["yes"]] if below else node, 2 * at + 1, kind, limit, leaf)
    fill_tree(below[node["no"]] if below else node, 2 * at + 2, kind, limit, leaf)


def add_trees(curves, evidence, labels, importance):
    """Trees of three questions for what the curves leave, by boosting; importance 1 in the mean."""
    places = curves.places(evidence)
    data = xgboost.DMatrix(places, labels, weight=importance / importance.mean(), base_margin=curves.logits(evidence))
    data.feature_names = ["f%d" % i for i in range(places.shape[1])]
    grown = xgboost.train(OPTIONS, data, model.TREES).get_dump(dump_format="json")
    kind, limit = (numpy.zeros((model.TREES, model.QUESTIONS), dtype=int) for _ in range(2))
    leaf_q8 = numpy.zeros((model.TREES, model.QUESTIONS + 1), dtype=int)
    for tree, text in enumerate(grown):
        fill_tree(json.loads(text), 0, kind[tree], limit[tree], leaf_q8[tree])
    return dataclasses.replace(curves, kind=kind, limit=limit, leaf_q8=leaf_q8)
