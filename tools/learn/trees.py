"""Trees of three questions for what the curves of model.py leave, by xgboost, in the firmware's numbers.

All trees ask out of one list, so that a tree is a few bytes: the questions by which larger trees gained most."""

import collections
import dataclasses
import json

import numpy
import xgboost

import model

OPTIONS = {"objective": "binary:logistic", "tree_method": "hist", "max_bin": 256, "max_depth": 3, "eta": 0.5,
           "subsample": 0.7, "colsample_bynode": 0.6, "lambda": 50.0, "min_child_weight": 10.0, "nthread": 1, "seed": 12}
CHOOSING = {"max_depth": 4, "eta": 0.2, "seed": 11}
CHOOSING_TREES = 256


def grow(values, labels, weights, margin, options, count):
    """The trees' first nodes."""
    data = xgboost.DMatrix(values, labels, weight=weights, base_margin=margin)
    data.feature_names = ["f%d" % i for i in range(values.shape[1])]
    grown = xgboost.train(options, data, count).get_dump(dump_format="json", with_stats=True)
    return [json.loads(text) for text in grown]


def question_of(node):
    """Feature and limit of a node's question."""
    return int(node["split"][1:]), int(numpy.ceil(node["split_condition"]))


def add_gains(node, gains):
    if "children" in node:
        gains[question_of(node)] += node["gain"]
        for child in node["children"]:
            add_gains(child, gains)


def choose_questions(places, labels, weights, margin):
    """Kind and limit of each."""
    gains = collections.Counter()
    for tree in grow(places, labels, weights, margin, OPTIONS | CHOOSING, CHOOSING_TREES):
        add_gains(tree, gains)
    return sorted(sorted(gains, key=gains.get, reverse=True)[:model.QUESTIONS])


def fill_tree(node, at, index, question, leaf):
    """From branch at on; a leaf that comes early is the answer to both sides of questions that ask nothing."""
    if at >= model.BRANCHES:
        leaf[at - model.BRANCHES] = int(numpy.clip(round(node["leaf"] * 256), -128, 127))
        return
    below = {child["nodeid"]: child for child in node.get("children", [])}
    if below:
        question[at] = index[question_of(node)]
    fill_tree(below[node["yes"]] if below else node, 2 * at + 1, index, question, leaf)
    fill_tree(below[node["no"]] if below else node, 2 * at + 2, index, question, leaf)


def add_trees(curves, evidence, labels, importance):
    """Trees of three questions for what the curves leave, by boosting; importance 1 in the mean."""
    places, weights, margin = curves.places(evidence), importance / importance.mean(), curves.logits(evidence)
    questions = choose_questions(places, labels, weights, margin)
    limits = [[limit for kind, limit in questions if kind == one] for one in range(places.shape[1])]
    passed = numpy.stack([numpy.searchsorted(limits[one], places[:, one], side="right") for one in range(places.shape[1])], axis=1)
    # The n-th limit of a kind is passed where n limits or more are.
    index = {(kind, limits[kind].index(limit) + 1): i for i, (kind, limit) in enumerate(questions)}
    question = numpy.zeros((model.TREES, model.BRANCHES), dtype=int)
    leaf_q8 = numpy.zeros((model.TREES, model.BRANCHES + 1), dtype=int)
    for tree, node in enumerate(grow(passed, labels, weights, margin, OPTIONS, model.TREES)):
        fill_tree(node, 0, index, question[tree], leaf_q8[tree])
    kind, limit = (numpy.array(column) for column in zip(*questions))
    return dataclasses.replace(curves, kind=kind, limit=limit, question=question, leaf_q8=leaf_q8)
