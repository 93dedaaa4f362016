"""Diagnosis of instances: reasons for unserved tasks, and data that may be mistakes."""
