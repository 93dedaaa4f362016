# A reader of the examples: both notebooks run from beginning to end, on the tables beside them.
jupyter execute own_data.ipynb --inplace
jupyter execute methods.ipynb --inplace
